"""Sensors as they are: cones, lost light, a bias of each beam, a turning lidar, and what goes wrong with a camera."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import minimum_filter1d
from scipy.stats import norm

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.sensing.cone import nearest_in_cones
from pbrg_mj.sensing.noise import noise_parameters
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.sensing.signal_strength import WHITE, SignalStrength, relative_power
from pbrg_mj.world.plant.interface import Observation
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.raycast import Scene, cast
from tests.scenario_texts import three
from tests.worlds import scenario, wall

EXACT = {"preset": "ideal", "robots": "all"}


def observed(poses: np.ndarray, frame: int, ranges: np.ndarray | None = None, **more: Any) -> Observation:
    return Observation(poses, frame, np.ones((len(poses), 4)) if ranges is None else ranges, frame, **more)


def test_a_cone_tells_of_the_nearest_thing_of_dense_rays() -> None:
    """Posts and a wall around a robot, 0.1 deg between rays: all of them are the oracle, by a sliding minimum."""
    rng, beams, half = np.random.default_rng(5), 24, 135
    missed = []
    for _ in range(20):
        angle, far = rng.uniform(0, 2 * np.pi, 6), rng.uniform(0.5, 2.0, 6)
        discs = np.column_stack([far * np.cos(angle), far * np.sin(angle), np.full(6, 0.2)])
        scene = Scene(((-3.0, 2.5, 3.0, 2.5),), tuple(map(tuple, discs.tolist())))
        dense = np.nan_to_num(cast(scene, np.zeros(3), 3600), nan=np.inf)
        true = minimum_filter1d(dense, 2 * half + 1, mode="wrap")[::150]
        for rays in (2 * half + 1, 28):
            at = (150 * np.arange(beams)[:, None] + np.linspace(-half, half, rays).astype(int)) % 3600
            raw = np.where(np.isfinite(dense[at]), dense[at], -1.0).reshape(1, -1)
            seen, which = nearest_in_cones(raw, rays)
            seen = np.where(seen[0] < 0, np.inf, seen[0])
            if rays > 28:
                assert np.array_equal(seen, true)
                assert np.array_equal(
                    np.take_along_axis(raw.reshape(beams, -1), which[0][:, None], 1)[:, 0] >= 0, np.isfinite(true)
                )
            else:
                assert (seen >= true).all()
                missed += (seen > true + 0.002).tolist()
    assert np.mean(missed) < 0.05  # what a degree between rays misses: edges that the view just grazes


@pytest.mark.parametrize(
    ("name", "nobody"),
    [("paper/simulation_near", ()), ("paper/experiment_near", ("sensors.beams.robots=[]", "estimator.source=given"))],
)
def test_where_nobody_has_beams_there_are_no_cones(name: str, nobody: tuple[str, ...]) -> None:
    """Nobody has any in the ideal plant, and in physics who is told so."""
    keys = ("sensors.beams.cone_deg=30", "reference.solver=none", *nobody)
    assert pbrg.run(pbrg.load(name, keys, duration=0.05)).metrics.ticks == 6


def test_nobody_has_beams_under_the_certified_governor() -> None:
    keys = ("governor.kind=certified", "sensors.beams.robots=[]", "reference.solver=none")
    assert pbrg.run(pbrg.load("paper/experiment_near", keys, duration=0.05)).metrics.ticks == 6


def test_cones_of_the_plant_meet_a_wall_where_it_is_nearest() -> None:
    """At 1 m from a long wall the cone's range is 1 / cos of what is left of the angle beyond its half-width."""
    beams = {**EXACT, "count": 24, "cone_deg": 27.0, "cone_rays": 28}
    plant = MujocoPlant(scenario(walls=(wall((1.05, -40), (1.05, 40)),), beams=beams, team={"start": [(0.04, 0)]}))
    noise = noise_parameters(scenario(beams=beams))
    seen = sense(plant.observe(), None, noise).ranges[0]
    angle = np.abs(np.deg2rad(15.0 * np.array([-3, -2, -1, 0, 1, 2, 3])))
    want = 1.0 / np.cos(np.maximum(angle - np.deg2rad(13.5), 0.0))
    np.testing.assert_allclose(seen[[-3, -2, -1, 0, 1, 2, 3]], want, rtol=2e-4)  # a degree between rays
    assert np.isnan(seen[12])


@pytest.mark.parametrize("incidence", [0, 60, 80])
def test_echoes_are_lost_as_the_law_says(incidence: int) -> None:
    """In physics at a wall, and over many scans by the readings' shares against the normal distribution."""
    signal = SignalStrength(2.0, 0.2)
    cosine, distance = np.cos(np.deg2rad(incidence)), np.array([0.5, 1.0, 1.5, 1.9, 2.1, 3.0])
    noise = dataclasses.replace(noise_parameters(scenario(beams=EXACT)), signal=signal)
    ranges, cosines = np.tile(distance, (1, 400)), np.full((1, 2400), cosine)
    poses = np.zeros((1, 3))
    heard = np.array(
        [np.isfinite(sense(observed(poses, k, ranges, cosines=cosines), None, noise).ranges[0]) for k in range(10)]
    )
    share = heard.reshape(-1, len(distance)).mean(axis=0)
    want = norm.cdf((1 - 1 / (cosine * (2.0 / distance) ** 2)) / 0.2)
    assert np.all(np.abs(share - want) < 4 * np.sqrt(want * (1 - want) / 4000) + 1e-9)
    assert relative_power(np.array([1.0]), np.array([1.0]), WHITE / 4, signal) == pytest.approx(1.0)


def test_the_plant_tells_how_obliquely_a_wall_is_met() -> None:
    beams = {**EXACT, "count": 8, "signal_range": 3.0}
    slanted = wall((1, -1), (3, 1))  # at 45 deg
    seen = MujocoPlant(scenario(walls=(slanted,), beams=beams)).observe()
    assert seen.cosines is not None
    assert seen.cosines[0, 0] == pytest.approx(np.sqrt(0.5), abs=1e-9)
    assert seen.cosines[0, 4] == 0.0 and seen.ranges[0, 4] == -1.0
    assert MujocoPlant(scenario(walls=(slanted,), beams=EXACT)).observe().cosines is None


@pytest.mark.parametrize("reflectance", [0.0, 0.05, 0.17, 1.0])
def test_dark_surfaces_are_lost_nearer_and_steeper(reflectance: float) -> None:
    """Shares of echoes over range and incidence against the normal distribution."""
    signal, rng = SignalStrength(2.0, 0.2), np.random.default_rng(17)
    noise = dataclasses.replace(noise_parameters(scenario(beams=EXACT)), signal=signal)
    distance, cosine = rng.uniform(0.2, 2.2, 8), np.cos(np.deg2rad(rng.uniform(0, 85, 8)))
    given = {"cosines": np.tile(cosine, (1, 400)), "reflectances": np.full((1, 3200), reflectance)}
    ranges = np.tile(distance, (1, 400))
    heard = [
        np.isfinite(sense(observed(np.zeros((1, 3)), k, ranges, **given), None, noise).ranges[0]) for k in range(10)
    ]
    share = np.reshape(heard, (-1, 8)).mean(axis=0)
    power = reflectance / 0.88 * cosine * (2.0 / distance) ** 2
    want = norm.cdf((1 - 1 / np.maximum(power, 1e-12)) / 0.2)
    assert np.all(np.abs(share - want) < 4 * np.sqrt(want * (1 - want) / 4000) + 1e-9)


def test_each_beam_has_an_error_of_its_own_that_stays() -> None:
    noise = noise_parameters(scenario(beams={**EXACT, "beam_bias_std": 0.02}))
    seen = np.array([sense(observed(np.zeros((1, 3)), k, np.ones((1, 4000))), None, noise).ranges for k in range(3)])
    assert np.array_equal(seen[0], seen[1]) and np.array_equal(seen[0], seen[2])
    error = seen[0] - 1.0
    assert error.std() == pytest.approx(0.02, rel=0.05) and abs(error.mean()) < 0.0015
    other = sense(observed(np.zeros((1, 3)), 0, np.ones((1, 4000))), None, dataclasses.replace(noise, seed=9)).ranges
    assert not np.array_equal(other, seen[0])


def test_a_turning_lidar_sees_each_beam_from_where_the_robot_was_then() -> None:
    """Pushed along straight at a wall, a robot's beams are ever nearer in the order of the turn."""
    beams = {**EXACT, "count": 8, "rate_hz": 5.0, "scan_time": 0.2, "start_deg": 0.0, "sweep_deg": 1e-3}
    given = scenario(walls=(wall((3, -1), (3, 1)),), beams=beams)
    plant = MujocoPlant(given)
    assert plant.observe().scan_frame == -1
    noise = noise_parameters(given)
    assert np.isnan(sense(plant.observe(), None, noise).ranges).all()
    places = []
    while plant.observe().scan_frame < 3:
        places.append(plant.truth().body_pose[0, 0])
        plant.advance(np.full((1, 2), 6.0))
    assert plant.observe().scan_frame == 3
    places.append(plant.truth().body_pose[0, 0])
    step = given.timing.tick
    at = (len(places) - 1) * step - 0.2 * (1 - (np.arange(8) + 1) / 8)  # [s] when each beam was taken
    want = 3 - 0.05 - np.interp(at, step * np.arange(len(places)), places)
    assert np.ptp(want) > 0.02
    np.testing.assert_allclose(plant.observe().ranges[0], want, atol=0.002)


def told(faults: dict, frames: int, rate: float = 10.0) -> list[Readings]:
    """What is told of two robots that are at (frame, 0) and (0, frame)."""
    camera = {"rate_hz": rate, "position_std": 0, "heading_std_deg": 0, **faults}
    given = scenario(2, sensors={"beams": {"robots": []}, "camera": camera})
    noise, readings, all_ = noise_parameters(given), None, []
    for frame in range(frames):
        poses = np.array([[frame, 0.0, 0.0], [0.0, frame, 0.0]])
        readings = sense(observed(poses, frame, np.empty((0, 4))), readings, noise)
        all_.append(readings)
    return all_


def test_lost_frames_hold_the_frame_before_for_all_at_the_rate_given() -> None:
    seen = told({"lost_frames": 0.3}, 4000)
    lost = np.array([one.pose_frame != k for k, one in enumerate(seen)])
    assert not lost[0] and abs(lost.mean() - 0.3) < 4 * np.sqrt(0.21 / 4000)
    for k, one in enumerate(seen):
        np.testing.assert_array_equal(one.body_pose[:, :2], [[one.pose_frame, 0], [0, one.pose_frame]])
        assert one.pose_frame == k or one.pose_frame == seen[k - 1].pose_frame
    assert [one.pose_frame for one in told({"lost_frames": 0.3}, 50)] == [one.pose_frame for one in seen[:50]]


def test_a_robot_that_is_not_found_keeps_its_pose_and_the_others_do_not() -> None:
    seen = told({"occlusions": [{"robot": 1, "time": 0.25, "duration": 0.3}]}, 10)
    assert [one.body_pose[0, 0] for one in seen] == [0, 1, 2, 2, 2, 2, 6, 7, 8, 9]
    assert [one.body_pose[1, 1] for one in seen] == list(range(10))
    assert [one.pose_frame for one in seen] == list(range(10))  # never told


def test_robots_mixed_up_have_each_others_poses() -> None:
    seen = told({"swaps": [{"robots": [1, 2], "time": 0.2, "duration": 0.2}]}, 6)
    for frame, one in enumerate(seen):
        own = [[frame, 0.0], [0.0, frame]]
        np.testing.assert_array_equal(one.body_pose[:, :2], own[::-1] if frame in (2, 3) else own)


@pytest.mark.parametrize(
    ("sensors", "says"),
    [
        ("{beams: {scan_time: 0.2}}", "sensors.beams.scan_time: is 0.2 s; allowed: at most 0.1 s"),
        (
            "{camera: {swaps: [{robots: [1, 1], time: 0, duration: 1}]}}",
            "sensors.camera.swaps.0.robots.1: is 1, which is in the list twice",
        ),
        (
            "{camera: {occlusions: [{robot: 4, time: 1, duration: 1}]}}",
            "sensors.camera.occlusions.0.robot: is robot 4; allowed: 1 to 3",
        ),
        (
            "{camera: {occlusions: [{robot: 1, time: 0, duration: 1}]}}",
            "sensors.camera.occlusions.0.time: is 0 s; allowed: later",
        ),
    ],
)
def test_what_cannot_be_is_refused(sensors: str, says: str) -> None:
    with pytest.raises(InputError) as told_:
        parse_scenario(three(sensors=sensors), "x.yaml")
    assert says in str(told_.value)
