"""Poses from radio ranges, and from wheel encoders and a camera: closed forms, and a filter as sure as it may be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.sensing.noise import noise_parameters
from pbrg_mj.sensing.pose_filter import FilterParameters, corrected, driven, encoder_angles, initial_memory, predicted
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.sensing.ultra_wideband import Radio, measured_ranges, place_of
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.scenario_texts import three
from tests.worlds import scenario

SQUARE = ((-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0))
PARAMETERS = FilterParameters(0.1, 0.02, 1e-9, 2e-4, 0.01, 0.02)
TICK = 0.01  # [s]


def test_ranges_without_errors_give_the_place() -> None:
    random = np.random.default_rng(1)
    radio = Radio(np.array(SQUARE), 0.0, 0.0, 0.3)
    for place in random.uniform(-1.9, 1.9, (50, 2)):
        np.testing.assert_allclose(place_of(measured_ranges(place, radio, random), radio.anchors), place, atol=1e-9)


def test_ranges_have_the_moments_of_a_gaussian_and_an_exponential_tail_that_is_late() -> None:
    random, radio, of = np.random.default_rng(2), Radio(np.array(SQUARE), 0.05, 0.2, 0.4), 20_000
    place = np.array([0.3, -0.5])
    true = np.linalg.norm(radio.anchors - place, axis=1)
    error = np.array([measured_ranges(place, radio, random) - true for _ in range(of)]).ravel()
    variance = 0.05**2 + 2 * 0.2 * 0.4**2 - (0.2 * 0.4) ** 2
    assert error.mean() == pytest.approx(0.08, abs=4 * np.sqrt(variance / error.size))
    assert error.var() == pytest.approx(variance, rel=0.03)
    assert np.mean(error > 0.5) > 50 * np.mean(error < -0.5)


def test_places_in_line_of_sight_spread_as_the_anchors_let_them() -> None:
    given = scenario(sensors={"beams": {"robots": []}, "uwb": {"anchors": SQUARE, "late_share": 0.0}})
    assert given.assumed_sensors.camera.position_std == pytest.approx(0.05 / np.sqrt(2))
    random, radio = np.random.default_rng(3), Radio(np.array(SQUARE), 0.05, 0.0, 0.0)
    places = np.array([place_of(measured_ranges(np.zeros(2), radio, random), radio.anchors) for _ in range(4000)])
    assert places.std(axis=0) == pytest.approx(0.05 / np.sqrt(2), rel=0.04)
    seen = sense(MujocoPlant(given).observe(), None, noise_parameters(given)).body_pose
    assert 0.0 < np.linalg.norm(seen[0, :2] - [-0.04, 0.0]) < 0.3


def test_encoders_count_whole_steps() -> None:
    np.testing.assert_allclose(encoder_angles(np.array([0.0, 0.49, 1.0, -0.1]), 0.5), [0.0, 0.0, 1.0, -0.5])


def test_a_turn_of_the_wheels_is_the_arc_of_its_closed_form() -> None:
    at = initial_memory(np.zeros((1, 3)), np.zeros((1, 2)), PARAMETERS).now
    left, right, steps = 0.8e-4, 1.2e-4, 5000
    for _ in range(steps):
        at = predicted(at, np.array([[left, right]]), PARAMETERS)
    turn, radius = (right - left) * steps / 0.1, 0.5 * (left + right) * 0.1 / (right - left)
    np.testing.assert_allclose(at.pose[0], [radius * np.sin(turn), radius * (1 - np.cos(turn)), turn], atol=1e-6)


@pytest.mark.parametrize("delay", [0.0, 0.15])
def test_the_filter_is_as_wrong_as_it_says_in_the_world_that_it_assumes(delay: float) -> None:
    """300 robots with slipping wheels and a camera of 5 Hz: mean NEES within its 95 % band, before and after frames."""
    random, n = np.random.default_rng(7), 300
    speed = random.uniform(2.0, 10.0, (n, 2))  # of the wheels [rad/s]
    truth = np.column_stack([random.uniform(-2, 2, (n, 2)), random.uniform(-3, 3, n)])
    spread = np.array([0.01, 0.01, 0.02])
    angle, poses = np.zeros((n, 2)), [truth]
    memory = initial_memory(truth + spread * random.standard_normal((n, 3)), angle, PARAMETERS)
    frames, squares = 20, []
    for k in range(1, 121):
        travel = 0.02 * TICK * speed
        angle = angle + travel / 0.02
        slipped = travel + np.sqrt(PARAMETERS.slip * travel) * random.standard_normal((n, 2))
        turn, forth = (slipped[:, 1] - slipped[:, 0]) / 0.1, slipped.mean(axis=1)
        middle = truth[:, 2] + turn / 2
        truth = truth + np.column_stack([forth * np.cos(middle), forth * np.sin(middle), turn])
        poses.append(truth)
        memory = driven(memory, angle, k * TICK, PARAMETERS)
        late = round(delay / TICK)
        if (k - late) % frames == 0 and k > late:
            seen = poses[k - late] + spread * random.standard_normal((n, 3))
            memory = corrected(memory, seen, (k - late) * TICK, PARAMETERS)
        if k in (15, 59, 80, 119):
            error = memory.now.pose - truth
            squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(memory.now.covariance), error).mean())
    low, high = chi2.ppf([0.025 / 4, 1 - 0.025 / 4], 3 * n) / n  # four of them
    assert all(low < square < high for square in squares), squares


def drive(sensors: dict, seconds: float = 2.0, seed: int = 1) -> tuple[np.ndarray, np.ndarray, list[Readings]]:
    """Errors (ticks, n, 3) of the poses told to two robots that drive in circles, true poses and readings."""
    given = scenario(2, sensors={"beams": {"robots": []}, **sensors}, seed=seed)
    plant, noise, readings = MujocoPlant(given), noise_parameters(given), None
    errors, true, all_ = [], [], []
    for _ in range(round(seconds / given.timing.tick)):
        readings = sense(plant.observe(), readings, noise)
        pose = plant.truth().body_pose
        error = readings.body_pose - pose
        error[:, 2] = np.angle(np.exp(1j * error[:, 2]))
        errors.append(error)
        true.append(pose)
        all_.append(readings)
        plant.advance(np.array([[2.5, 3.0], [3.0, 2.5]]))
    return np.array(errors), np.array(true), all_


SLOW = {"rate_hz": 2.0, "delay": 0.2}


def test_in_physics_encoders_bridge_what_a_rare_and_late_camera_leaves_out() -> None:
    alone, true, _ = drive({"camera": SLOW})
    fused, same, _ = drive({"camera": SLOW, "odometry": {"fuse": True}})
    assert np.array_equal(true, same) and np.ptp(true[:, 0, 0]) > 0.1
    far = np.linalg.norm(alone[50:, :, :2], axis=2)
    near = np.linalg.norm(fused[50:, :, :2], axis=2)
    assert far.max() > 0.1 and near.max() < 0.02
    again, _, _ = drive({"camera": SLOW, "odometry": {"fuse": True}})
    assert np.array_equal(fused, again)


@pytest.mark.parametrize(
    "fault",
    [
        {"swaps": [{"robots": [1, 2], "time": 0.7, "duration": 0.25}]},
        {"occlusions": [{"robot": 1, "time": 0.5, "duration": 0.4}]},
    ],
)
def test_the_filter_does_not_believe_a_camera_that_mixes_robots_up(fault: dict) -> None:
    camera = {"rate_hz": 20.0, **fault}
    alone, *_ = drive({"camera": camera}, 1.5)
    fused, *_ = drive({"camera": camera, "odometry": {"fuse": True}}, 1.5)
    assert np.abs(alone[:, 0, :2]).max() > 0.05
    assert np.abs(fused[:, :, :2]).max() < 0.02


@pytest.mark.parametrize(
    ("sensors", "says"),
    [
        ("{uwb: {anchors: [[0, 0], [1, 0]]}}", "sensors.uwb.anchors: has 2 anchors; allowed: none, or three or more"),
        ("{uwb: {anchors: [[0, 0], [1, 1], [3, 3]]}}", "allowed: places that are not on one line"),
    ],
)
def test_anchors_that_tell_no_place_are_refused(sensors: str, says: str) -> None:
    with pytest.raises(InputError) as told:
        parse_scenario(three(sensors=sensors), "x.yaml")
    assert says in str(told.value)


def test_a_robot_without_wheels_has_no_encoders() -> None:
    with pytest.raises(InputError, match="has no wheels to count"):
        noise_parameters(scenario(robot="omni", sensors={"odometry": {"fuse": True}}))
