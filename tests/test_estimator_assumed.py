"""What perception assumes of the sensors is apart from what they are, and by default the same."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.perception.scan.parameters import line_parameters
from pbrg_mj.perception.track.pose_history import no_poses, poses_at_scan, with_poses
from pbrg_mj.perception.track.world_frame import pose_model
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.schema import PRESETS, Beams, Scenario
from pbrg_mj.sensing.noise import noise_parameters
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.scene.robot import load_robot_model
from tests.perceiving import readings, scenario, setup
from tests.raycast import Scene
from tests.scenario_texts import three

WALL = Scene(((2.0, -1.5, 2.0, 1.5),))
SPEED, DELAY = 0.4, 0.1  # [m/s], [s]


def track(given: Scenario) -> np.void:
    """The wall as it is known after one scan, seen without noise of the camera."""
    config = setup(given)
    seen = readings([WALL], np.zeros((1, 3)), noise_parameters(given), 0)
    _, memory = perceive(seen, 0.0, initial(config), config)
    (found,) = memory.tracks[0][memory.tracks[0]["live"] == 1]
    return found


def with_camera(assumed: dict | None = None, **beams: float) -> Scenario:
    sensors = {"beams": beams, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}}
    return scenario(sensors=sensors, estimator={"assumed": assumed or {}})


@pytest.mark.parametrize("preset", PRESETS)
def test_by_default_the_sensors_are_assumed_to_be_as_they_are(preset: str) -> None:
    own = scenario(sensors={"beams": {"preset": preset}})
    beams, camera = own.sensors.beams, own.sensors.camera
    names = ("noise_std", "noise_ratio", "quantum", "dropout", "outliers", "cone_deg", "scan_time")
    same = {
        "beams": {name: getattr(beams, name) for name in names},
        "camera": {name: getattr(camera, name) for name in ("position_std", "heading_std_deg", "delay")},
    }
    spelt = scenario(sensors={"beams": {"preset": preset}}, estimator={"assumed": same})
    assert own.assumed_sensors == own.sensors == spelt.assumed_sensors
    assert setup(own).packed[2:5] == setup(spelt).packed[2:5]
    assert line_parameters(own, 0.1) == line_parameters(spelt, 0.1)


def test_assumed_noise_changes_what_is_believed_and_nothing_that_is_read() -> None:
    right, doubled = with_camera(), with_camera({"beams": {"noise_std": 0.01}})
    assert noise_parameters(right) == noise_parameters(doubled)
    one, other = track(right), track(doubled)
    # All beams are as much worse, so the line is the same and its covariance four times as large.
    assert (other["angle"], other["offset"]) == pytest.approx((one["angle"], one["offset"]), abs=1e-9)
    for name in ("p_aa", "p_cc"):
        assert other[name] == pytest.approx(4.0 * one[name], rel=1e-3)


def test_all_that_is_assumed_is_read_from_there() -> None:
    assumed = {
        "beams": {"noise_std": 0.02, "noise_ratio": 0.1, "quantum": 0.012, "dropout": 0.3, "outliers": 0.1},
        "camera": {"position_std": 0.3, "heading_std_deg": 2.0, "delay": 0.05},
    }
    given = scenario(estimator={"assumed": assumed, "source": "points", "scope": "own"})
    truly = scenario(sensors={"beams": assumed["beams"], "camera": assumed["camera"]})
    assert line_parameters(given, 0.1) == line_parameters(truly, 0.1)
    points, of_truly = (point_parameters(one, load_robot_model()) for one in (given, truly))
    assert (points.range_std, points.noise_ratio) == (of_truly.range_std, of_truly.noise_ratio)
    assert pose_model(given)[:4] == pose_model(truly)[:4] and setup(given).packed[3] == setup(truly).packed[3]
    assert (pose_model(given).timestamp_offset, pose_model(truly).timestamp_offset) == (-0.05, 0.0)


@pytest.mark.parametrize("assumed", [None, 0.0, 0.05])
def test_a_pose_is_dated_back_by_the_delay_that_is_assumed(assumed: float | None) -> None:
    """At a constant speed a pose carried on to the scan is right if the delay is, and behind by the rest if not."""
    camera = {"rate_hz": 20.0, "delay": DELAY}
    model = pose_model(scenario(sensors={"camera": camera}, estimator={"assumed": {"camera": {"delay": assumed}}}))
    history, missing = no_poses(1, model.frames), 0.0 if assumed is None else DELAY - assumed
    for frame in range(8):  # scans at 10 Hz; frames at 20 Hz arrive 0.1 s late
        time = 0.05 * frame + DELAY
        seen = np.array([[SPEED * frame / 20, 0.0, 0.0]])
        readings = Readings(seen, np.empty((1, 0)), frame % 2 == 0, frame, round(time * 10 - 0.25))
        history = with_poses(history, readings, time, model)
        if frame % 2 == 0 and frame > 1:  # a speed takes two frames
            at = poses_at_scan(history, readings, model)
            assert at.poses[0, 0] == pytest.approx(SPEED * (time - missing), abs=1e-9)


def test_delays_beyond_bounds_are_refused_and_null_is_allowed() -> None:
    with pytest.raises(InputError, match=r"estimator.assumed.camera.delay: is 11.0 s; allowed: at most 10.0 s"):
        parse_scenario(three(estimator="{assumed: {camera: {delay: 11}}}"), "x.yaml")
    assert parse_scenario(three(estimator="{assumed: {beams: {noise_std: null}}}")).assumed_sensors.beams == Beams()
