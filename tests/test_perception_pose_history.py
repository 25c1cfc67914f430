"""Poses extrapolated from the camera's last frames to a scan, held against motions in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pbrg_mj.perception.track.pose_history import (
    PoseHistory,
    PosesAtScan,
    exposure,
    extrapolated,
    no_poses,
    poses_at_scan,
    scanned,
    with_poses,
)
from pbrg_mj.perception.track.world_frame import LAST, pose_model
from pbrg_mj.scenario.schema import PRESETS, Scenario
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import scenario

Way = Callable[[np.ndarray], np.ndarray]
EXACT = {"rate_hz": 30.0, "position_std": 0.0, "heading_std_deg": 0.0}
LATE = {"delay": 0.06}
RUNS = 300  # of one robot each


def circle(speed: float, turn: float) -> Way:
    """A robot on a circle: poses (..., 3) at times (...)."""

    def pose(time: np.ndarray) -> np.ndarray:
        heading = 2.5 + turn * np.asarray(time)
        return np.stack([speed / turn * np.sin(heading), -speed / turn * np.cos(heading), heading], axis=-1)

    return pose


def oscillation(rng: np.random.Generator) -> Way:
    """A robot that drives to and fro and oscillates at 0.5 to 2 Hz by up to 25 deg, from any phase."""
    rates, phases = 2.0 * math.pi * rng.uniform(0.5, 2.0, 2), rng.uniform(0.0, 2.0 * math.pi, 2)
    angle, reach = math.radians(rng.uniform(0.0, 25.0)), rng.uniform(0.0, 0.03)

    def pose(time: np.ndarray) -> np.ndarray:
        time = np.asarray(time)
        heading, along = angle * np.sin(rates[0] * time + phases[0]), reach * np.sin(rates[1] * time + phases[1])
        return np.stack([0.2 * time + along, 0.5 * along, heading], axis=-1)

    return pose


def at_last_scan(given: Scenario, way: Way, scans: int, rng: np.random.Generator) -> tuple[PosesAtScan, np.ndarray]:
    """Estimate and true pose at the last of so many scans, each used as soon as it is there."""
    model, camera = pose_model(given), given.sensors.camera
    std = np.array([camera.position_std, camera.position_std, math.radians(camera.heading_std_deg)])
    end = scanned(scans, model)
    times = np.array([exposure(frame, model) for frame in range(int(end / model.frame_period) + 1)])
    times = times[times + camera.delay <= end + 1e-9]
    seen, history = way(times)[:, None] + std * rng.standard_normal((len(times), 1, 3)), no_poses(1, model.frames)
    told = [Readings(poses, np.empty((1, 0)), True, frame, scans) for frame, poses in enumerate(seen)]
    for readings, time in zip(told, times, strict=True):
        history = with_poses(history, readings, time + camera.delay, model)
    return poses_at_scan(history, told[-1], model), way(np.array([end]))


def robots_at_scan(given: Scenario, robots: int, scan: int, rng: np.random.Generator) -> tuple[PosesAtScan, np.ndarray]:
    """Estimates and true poses (robots, 3) at a scan of robots on circles."""
    model, camera = pose_model(given), given.sensors.camera
    std = np.array([camera.position_std, camera.position_std, math.radians(camera.heading_std_deg)])
    speed, turn, start = rng.uniform(0.05, 0.2, robots), rng.uniform(0.1, 0.5, robots), rng.uniform(-3.0, 3.0, robots)

    def way(time: float) -> np.ndarray:
        heading = start + turn * time
        return np.column_stack([speed / turn * np.sin(heading), -speed / turn * np.cos(heading), heading])

    history, end, frame = no_poses(robots, model.frames), scanned(scan, model), 0
    while exposure(frame, model) + camera.delay <= end + 1e-9:
        exposed = exposure(frame, model)
        poses = way(exposed) + std * rng.standard_normal((robots, 3))
        told = Readings(poses, np.empty((1, 0)), True, frame, scan)
        history, frame = with_poses(history, told, exposed + camera.delay, model), frame + 1
    return poses_at_scan(history, told, model), way(end)


def squares(at: PosesAtScan, true: np.ndarray) -> tuple[float, float]:
    """Normalised errors squared of the heading, one degree of freedom, and of the place, two."""
    error = at.poses[0] - true[0]
    turn = math.remainder(error[2], 2.0 * math.pi)
    return turn**2 / at.variances[0, 1], float(error[:2] @ error[:2]) / at.variances[0, 0]


@pytest.mark.parametrize("age", [0.008, 0.025, 0.1, 0.45])
def test_on_a_circle_poses_are_extrapolated_exactly_whatever_frames_are_there(age: float) -> None:
    model, way = pose_model(scenario(sensors={"camera": EXACT})), circle(0.3, 1.2)
    time = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.08, 12))
    poses = way(time)[:, None]
    poses[..., 2] = np.remainder(poses[..., 2] + math.pi, 2.0 * math.pi) - math.pi
    at = extrapolated(PoseHistory(time, poses), age, model)
    true = way(time[-1] + age)
    np.testing.assert_allclose(at.poses[0, :2], true[:2], atol=2e-5 if age < 0.2 else 3e-4)  # chords for arcs
    assert math.remainder(at.poses[0, 2] - true[2], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert at.variances[0].max() < 1e-6


def test_at_rest_the_longest_span_is_taken_and_its_noise_is_all() -> None:
    model = pose_model(scenario())
    time = np.arange(32) / 30.0
    at = extrapolated(PoseHistory(time, np.zeros((32, 1, 3))), 0.025, model)
    ratio = 0.025 * 30.0 / 5.0
    noise = (1.0 + ratio) ** 2 + ratio**2
    np.testing.assert_allclose(at.variances[0], [noise * model.position_var, noise * model.heading_var])


def test_an_acceleration_takes_the_shortest_span_and_counts_in_full() -> None:
    """theta = alpha t^2 / 2 is behind by alpha a (a + T) / 2, and that is what is believed."""
    model, alpha, age = pose_model(scenario(sensors={"camera": EXACT})), 30.0, 0.025
    time = np.arange(32) / 30.0
    poses = np.zeros((32, 1, 3))
    poses[:, 0, 2] = 0.5 * alpha * time**2
    at = extrapolated(PoseHistory(time, poses), age, model)
    behind = 0.5 * alpha * (time[-1] + age) ** 2 - at.poses[0, 2]
    assert behind == pytest.approx(0.5 * alpha * age * (age + 1.0 / 30.0))
    assert at.variances[0, 1] == pytest.approx(behind**2)


@pytest.mark.parametrize("camera", [{"rate_hz": 30.0}, {"rate_hz": 30.0, "delay": 0.05}, {"rate_hz": 12.0}])
@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_oscillating_robots_know_how_well_they_know_their_poses(preset: str, camera: dict) -> None:
    """No mean is above the band of honest ones (99.9 %); those of robots that are too careful may be below it.

    So it is with what accelerations add at most, and with what they add in the mean.
    """
    given = scenario(sensors={"beams": {"preset": preset}, "camera": camera})
    found = []
    for run in range(RUNS):
        rng = np.random.default_rng([run, 23])
        at, true = at_last_scan(given, oscillation(rng), int(rng.integers(12, 20)), rng)
        found.append([*squares(at, true), *squares(at._replace(variances=at.error_variances), true)])
    heading, place, heading_in_mean, place_in_mean = np.mean(found, axis=0)
    assert 0.4 < heading < 1.01 * heading_in_mean < 1.0 + 3.3 * math.sqrt(2.0 / RUNS)
    assert 1.0 < place < 1.01 * place_in_mean < 2.0 + 3.3 * math.sqrt(4.0 / RUNS)


def test_at_a_constant_twist_the_noise_of_frames_is_no_acceleration() -> None:
    """What accelerations add at most is above the noise by a fifth here, in the mean it is not: poses 25 ms old."""
    given, way = scenario(sensors={"beams": {"preset": "lidar"}}), circle(0.2, 0.5)
    rng, found = np.random.default_rng(77), []
    for _ in range(2000):
        at, true = at_last_scan(given, way, 13, rng)
        error = at.poses[0] - true[0]
        turn = math.remainder(error[2], 2.0 * math.pi)
        found.append([0.5 * error[:2] @ error[:2], turn**2, *at.variances[0], *at.error_variances[0]])
    place, heading, *believed = np.mean(found, axis=0)
    assert min(believed[0] / place, believed[1] / heading) > 1.12
    assert 0.93 < believed[2] / place < 1.1 and 0.93 < believed[3] / heading < 1.1


def test_variances_of_errors_are_unbiased_at_a_constant_twist() -> None:
    """Accelerations add nothing in the mean: robots on circles, poses 16 to 86 ms old, in the first second and later.

    The span of least variance is chosen by what frames tell of it, so late poses are believed a little too much. A mean
    of squares that is cut at 0 and counts frames before the first one is 4 to 120 % above.
    """
    for camera, scan, low in (({}, 6, 0.97), ({}, 21, 0.97), (LATE, 9, 0.9), (LATE, 22, 0.9)):
        given = scenario(sensors={"beams": {"preset": "lidar"}, "camera": camera})
        at, true = robots_at_scan(given, 20_000, scan, np.random.default_rng([41, scan]))
        error = at.poses - true
        turn = np.remainder(error[:, 2] + math.pi, 2.0 * math.pi) - math.pi
        believed = at.error_variances.mean(axis=0)
        assert low < believed[0] / (0.5 * np.mean(np.sum(error[:, :2] ** 2, axis=1))) < 1.03
        assert low < believed[1] / np.mean(turn**2) < 1.03


def test_frames_that_repeat_the_first_one_measure_no_acceleration() -> None:
    """Of a robot that accelerates from its first frame on, errors have alpha a (a + T) / 2, however few frames are."""
    model, alpha, age, period = pose_model(scenario(sensors={"camera": EXACT})), 30.0, 0.025, 1.0 / 30.0
    for moving, share in ((26, 1.0), (LAST + 1, 1.0), (LAST, (LAST - 1) / 30.0)):
        time, poses = period * np.arange(32), np.zeros((32, 1, 3))
        since = np.maximum(time - time[-moving - 1], 0.0)
        poses[:, 0, 0], poses[:, 0, 2] = 0.1 * since, 0.5 * alpha * since**2
        at = extrapolated(PoseHistory(time, poses), age, model)
        repeated = (0.25 / 30.0) * (moving < LAST + 1)  # of the first step: from rest, half of it
        behind = 0.5 * alpha * age * (age + period)
        assert at.error_variances[0, 1] == pytest.approx((share + repeated) * behind**2), moving


def test_no_extrapolation_is_believed_to_be_better_than_a_frame() -> None:
    """Poses that follow a circle exactly tell that noise is less than is assumed, but not that there is none."""
    model, time = pose_model(scenario()), np.arange(32) / 30.0
    at = extrapolated(PoseHistory(time, circle(0.2, 0.5)(time)[:, None]), 0.025, model)
    np.testing.assert_array_equal(at.error_variances[0], [model.position_var, model.heading_var])


def test_scans_that_come_with_frames_extrapolate_nothing() -> None:
    given = scenario()
    model = pose_model(given)
    assert model.frames == 0
    readings = Readings(np.ones((1, 3)), np.empty((1, 0)), True, 3, 1)
    at = poses_at_scan(with_poses(no_poses(1, 0), readings, 0.1, model), readings, model)
    assert at.poses is readings.body_pose
    np.testing.assert_array_equal(at.variances, [[model.position_var, model.heading_var]])


def test_before_the_first_frame_robots_were_where_they_are_then() -> None:
    given = scenario(sensors={"beams": {"preset": "lidar"}})
    model = pose_model(given)
    unseen = no_poses(1, model.frames)
    nothing = Readings(np.full((1, 3), np.nan), np.empty((1, 0)), True, -1, 0)
    assert with_poses(unseen, nothing, 0.0, model) is unseen
    assert np.isnan(poses_at_scan(unseen, nothing, model).poses).all()
    first = Readings(np.array([[1.0, 2.0, 3.0]]), np.empty((1, 0)), True, 0, 0)
    history = with_poses(unseen, first, 0.0, model)
    assert with_poses(history, first, 0.01, model) is history
    later = Readings(first.body_pose, np.empty((1, 0)), True, 3, 1)
    np.testing.assert_allclose(poses_at_scan(history, later, model).poses, first.body_pose)
