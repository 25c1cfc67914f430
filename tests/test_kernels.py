"""Compiled stages of the tick against plain numpy versions of the same formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import small_bounds, small_matrix, tightest_rows
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Control, Wall
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import SensorNoise
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.vehicle.hand_point import hand_point, wheel_speeds
from pbrg_mj.world.actuation.motor_driver import saturate
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.footprints import footprints_of, signed_distance, wall_margin
from pbrg_mj.world.scene.robot import load_robot_model
from tests.problems import GRAPHS, graph, random_problem
from tests.worlds import scenario

ROBOT = load_robot_model()


def rows_of_e(heading):
    return np.column_stack([np.cos(heading), np.sin(heading)])


def test_hand_points_and_wheel_speeds():
    rng = np.random.default_rng(1)
    pose, velocity = rng.normal(size=(50, 3)), rng.normal(size=(50, 2))
    e = rows_of_e(pose[:, 2])
    np.testing.assert_allclose(hand_point(pose, 0.06), pose[:, :2] + 0.06 * e, rtol=0, atol=1e-15)
    v = np.sum(e * velocity, axis=1)
    omega = e[:, 0] * velocity[:, 1] - e[:, 1] * velocity[:, 0]
    turn = omega / ROBOT.hand_offset * ROBOT.track / 2
    want = np.column_stack([v - turn, v + turn]) / ROBOT.wheel_radius
    np.testing.assert_allclose(wheel_speeds(velocity, pose[:, 2], ROBOT), want, rtol=1e-13)


def test_saturation_keeps_the_ratio_of_the_wheels():
    wanted = np.random.default_rng(2).uniform(-20, 20, (50, 2))
    scale = np.minimum(1.0, 6.0 / np.abs(wanted).max(axis=1, keepdims=True))
    np.testing.assert_allclose(saturate(wanted, 6.0), wanted * scale, rtol=1e-15)


@pytest.mark.parametrize("name", GRAPHS)
def test_the_pre_stabiliser_is_eq_2_with_the_laplacian_as_a_matrix(name):
    rng = np.random.default_rng(3)
    network = graph(GRAPHS[name], leaders=(0, 4))
    p, xi, m = rng.normal(size=(3, 5, 2))
    u, rate = pre_stabilise(network, Control(alpha_r=2.5, leak=0.3), p, xi, m)
    L, delta = network.laplacian, network.leader[:, None]
    np.testing.assert_allclose(u, -L @ (p - xi) + 2.5 * delta * (m - p), rtol=0, atol=1e-14)
    np.testing.assert_allclose(rate, -L @ (p + 0.3 * xi), rtol=0, atol=1e-14)


def test_wall_margins_are_the_least_signed_distances():
    rng = np.random.default_rng(4)
    walls = [Wall(start=tuple(a), end=tuple(b), thickness=0.3) for a, b in rng.uniform(-2, 2, (6, 2, 2))]
    points = rng.uniform(-3, 3, (500, 2))
    rectangles = footprints_of(walls)
    want = signed_distance(points, rectangles).min(axis=1) - 0.1
    assert (want < -0.1).any()  # some lie inside a wall
    np.testing.assert_allclose(wall_margin(points, rectangles, 0.1), want, rtol=0, atol=1e-14)


def test_true_poses_are_those_of_the_free_joints():
    world = MujocoPlant(scenario(3, team={"heading_deg": [10.0, 100.0, -170.0]}))
    for _ in range(20):
        world.advance(np.tile([2.0, 5.0], (3, 1)))
    pose = world.truth().body_pose
    for j in range(3):
        x, y, _, w, i, k, l = world.data.joint(f"robot{j}/free").qpos  # noqa: E741
        heading = np.arctan2(2 * (w * l + i * k), 1 - 2 * (k * k + l * l))
        np.testing.assert_allclose(pose[j], [x, y, heading], rtol=0, atol=1e-12)


def plain_scan(raw, noise, random):
    """The beam model's docstring, array by array."""
    additive, dropped = random.standard_normal(len(raw)), random.random(len(raw))
    ratio, strayed, stray = random.standard_normal(len(raw)), random.random(len(raw)), random.random(len(raw))

    def quantised(x):
        return np.round(x / noise.quantum) * noise.quantum if noise.quantum else x

    def seen(x):
        return (x >= noise.range_min) & (x < noise.range_max)

    noisy = quantised(raw + noise.range_std * additive + noise.range_ratio * raw * ratio)
    ranges = np.where(seen(raw) & seen(noisy), noisy, np.nan)
    ranges = np.where(
        strayed < noise.outliers, quantised(noise.range_min + (noise.range_max - noise.range_min) * stray), ranges
    )
    return np.where((dropped >= noise.dropout) & seen(ranges), ranges, np.nan)


@pytest.mark.parametrize("quantum", [0.0, 0.01])
def test_scans_are_the_beam_models_bit_for_bit(quantum):
    noise = SensorNoise(3, (0,), 0.0, 0.0, range_min=0.1, range_max=4.0, range_std=0.005, dropout=0.02)
    noise = replace(noise, range_ratio=0.03, outliers=0.05, quantum=quantum)
    raw = np.random.default_rng(5).uniform(-0.5, 4.5, 20000)
    got, want = (scan(raw, noise, stream(3, Source.BEAMS, 0, 1)) for scan in (noisy_scan, plain_scan))
    np.testing.assert_array_equal(got, want)
    assert 0.05 < np.isnan(got).mean() < 0.5


def test_the_small_forms_arrays():
    rng = np.random.default_rng(6)
    for _ in range(50):
        problem = random_problem(rng, graph(leaders=(0, 4)))
        rows = problem.rows
        robot, row = tightest_rows(rows)
        groups = {}  # of one robot, one half-space: rows that differ in d alone
        for i, r in np.argwhere(rows.active):
            key = (i, r // 5)
            groups[key] = min(groups.get(key, (np.inf, 0)), (rows.d[i, r], r))
        assert list(zip(robot, row, strict=True)) == [(i, r) for (i, _), (_, r) in sorted(groups.items())]
        count, centre = len(robot), problem.p.mean(axis=0)
        A = np.zeros((count + 4, 3))
        A[:count] = np.column_stack([rows.C[robot, row], rows.a[robot, row]])
        A[count, 2], A[count + 1, 0], A[count + 2, 1] = -1.0, -np.sqrt(5), -np.sqrt(5)
        stored = np.concatenate([A[[*range(count), count + 1], 0], A[[*range(count), count + 2], 1], A[: count + 1, 2]])
        np.testing.assert_allclose(small_matrix(problem, (robot, row)), stored, rtol=1e-15)
        s = np.sqrt(np.sum((problem.p - centre) ** 2) + np.sum(problem.xi**2))
        b = small_bounds(problem, (robot, row))
        np.testing.assert_allclose(b, [*rows.d[robot, row], 0.0, *(-np.sqrt(5) * centre), s], rtol=1e-13, atol=1e-14)
