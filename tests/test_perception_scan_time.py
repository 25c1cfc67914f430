"""Lines of a scan that takes time: the robot moves on between its beams, and so do its team-mates."""

from __future__ import annotations

import numpy as np

from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.setup import PerceptionSetup, perception_setup
from pbrg_mj.perception.track.deskew import deskewed
from pbrg_mj.perception.track.pose_history import no_poses, with_poses
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.noise import noise_parameters
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.perceiving import CLEARANCE, HAND, scenario
from tests.raycast import Scene, cast
from tests.worlds import scenario as in_physics
from tests.worlds import wall

FRAME = 1 / 30  # of the camera [s]
STEP = 0.002  # of physics, at which beams are taken when they are due [s]
ROOM = Scene(((-2.0, -1.5, 2.5, -1.5), (2.5, -1.5, 2.5, 1.8), (2.5, 1.8, -2.0, 1.8), (-2.0, 1.8, -2.0, -1.5)))
EXACT = {"preset": "lds_02", "noise_std": 0.0, "noise_ratio": 0.0, "quantum": 0.0, "dropout": 0.0, "outliers": 0.0}


def on_arc(time: float) -> np.ndarray:
    """The pose (3,) of a robot at 0.3 m/s and 0.8 rad/s."""
    heading = 0.4 + 0.8 * time
    return np.array([0.375 * (np.sin(heading) - np.sin(0.4)), -0.375 * (np.cos(heading) - np.cos(0.4)), heading])


def taken(given: Scenario, scene: Scene, end: float) -> np.ndarray:
    """Exact ranges (1, beams) [m] of a scan that ends at a time [s]."""
    beams, ranges = given.sensors.beams, []
    for k in range(beams.count):
        begun = end - beams.scan_time * (1.0 - (k + 1) / beams.count)
        pose = on_arc(np.ceil(begun / STEP - 1e-6) * STEP)
        ranges.append(cast(scene, pose + np.array([0.0, 0.0, 2.0 * np.pi * k / beams.count]), 1, beams.range_max)[0])
    return np.array(ranges)[None]


def drive(setup: PerceptionSetup, given: Scenario, scene: Scene, seconds: float) -> PerceptionMemory:
    """Let a robot drive on its arc; return what it remembers after its last scan. The first scan begins at t = 0."""
    memory, scans = initial(setup), 0
    ranges = np.full((1, given.sensors.beams.count), np.nan)
    for frame in range(round(seconds / FRAME) + 1):
        time, new = frame * FRAME, False
        if frame > 0 and frame % 6 == 0:
            scans, new, ranges = scans + 1, True, taken(given, scene, time)
        readings = Readings(on_arc(time)[None], ranges, new, frame, scans)
        _, memory = perceive(readings, time, memory, setup)
    return memory


def first_scan(setup: PerceptionSetup, ranges: np.ndarray, stds: np.ndarray, seed: int) -> PerceptionMemory:
    """What is remembered of the first scan by a robot whose frames have noise of `stds` (3,) [m], [rad]."""
    random, memory, nothing = np.random.default_rng([seed, 5]), initial(setup), np.full_like(ranges, np.nan)
    for frame in range(7):
        seen = on_arc(frame * FRAME) + stds * random.standard_normal(3)
        readings = Readings(seen[None], ranges if frame == 6 else nothing, frame == 6, frame, int(frame == 6))
        _, memory = perceive(readings, frame * FRAME, memory, setup)
    return memory


def errors(memory: PerceptionMemory) -> np.ndarray:
    """Errors (tracks, 2) of the angle [rad] and the offset [m] of all that is tracked, in the ROOM."""
    found, anchor = [], memory.anchors[0]
    for track in memory.tracks[0][memory.tracks[0]["live"] == 1]:
        quarter = round(track["angle"] / (np.pi / 2))
        distances = 2.5 - anchor["x"], 1.8 - anchor["y"], 2.0 + anchor["x"], 1.5 + anchor["y"]
        found.append((track["angle"] - quarter * np.pi / 2, track["offset"] - distances[quarter % 4]))
    return np.array(found)


def test_walls_are_where_they_are_to_a_robot_that_turns_while_it_scans() -> None:
    given = scenario(sensors={"beams": EXACT, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}})
    found = errors(drive(perception_setup(given, CLEARANCE, HAND), given, ROOM, 2.0))
    assert len(found) == 4
    assert np.abs(found[:, 0]).max() < 5e-4
    assert np.abs(found[:, 1]).max() < 5e-4


def test_a_scan_that_is_assumed_to_be_taken_at_once_turns_the_walls() -> None:
    given = scenario(sensors={"beams": {"preset": "lds_02"}}, estimator={"assumed": {"beams": {"scan_time": 0.0}}})
    found = errors(drive(perception_setup(given, CLEARANCE, HAND), given, ROOM, 2.0))
    assert np.abs(found[:, 0]).max() > 0.05


def test_the_noise_of_frames_within_a_scan_is_counted_for_each_of_them() -> None:
    """Ranges exact, frames with noise: the covariance is that of 400 robots. That of one frame's noise is too small."""
    camera = {"position_std": 0.004, "heading_std_deg": 0.4}
    given = scenario(sensors={"beams": EXACT, "camera": camera})
    setup, ranges = perception_setup(given, CLEARANCE, HAND), taken(given, ROOM, 0.2)
    stds, squares, one_frame = np.array([0.004, 0.004, np.deg2rad(0.4)]), [], []
    for seed in range(400):
        memory = first_scan(setup, ranges, stds, seed)
        tracks = memory.tracks[0][memory.tracks[0]["live"] == 1]
        k = seed % len(tracks)
        error, track = errors(memory)[k], tracks[k]
        P = np.array([[track["e_aa"], track["e_ac"]], [track["e_ac"], track["e_cc"]]])
        squares.append(error @ np.linalg.solve(P, error))
        one_frame.append(np.sum((error / stds[[2, 0]]) ** 2))
    assert 1.8 < np.mean(squares) < 2.2
    assert np.mean(one_frame) > 2.5


def test_echoes_of_physics_are_where_the_robot_was_when_their_beams_were_taken() -> None:
    """A robot turns fast before a wall in physics; ranges and poses are exact, a pose every tick."""
    camera = {"position_std": 0.0, "heading_std_deg": 0.0, "rate_hz": 100.0}
    beams = {**EXACT, "robots": "all"}
    given = in_physics(walls=(wall((1.5, -8), (1.5, 8)),), beams=beams, sensors={"camera": camera})
    plant, noise, setup = MujocoPlant(given), noise_parameters(given), perception_setup(given, CLEARANCE, HAND)
    readings, history, off, turned = None, no_poses(1, setup.pose.frames), [], []
    for tick in range(200):
        readings = sense(plant.observe(), readings, noise)
        history = with_poses(history, readings, 0.01 * tick, setup.pose)
        if readings.new_scan and readings.scan_frame > 2:
            seen = deskewed(readings, history, readings.body_pose, np.array([0]), setup)
            x, _, heading = readings.body_pose[0]
            ahead = np.cos(heading) * seen.directions[0, :, 0] - np.sin(heading) * seen.directions[0, :, 1]
            met = (ahead > 0.3) & np.isfinite(seen.ranges[0])
            off += list((x + seen.ranges[0] * ahead)[met] - 1.45)
            turned.append(heading)
        plant.advance(np.array([[-3.0, 3.0]]))
    assert np.ptp(turned) > 1.5 and len(off) > 300
    assert np.abs(off).max() < 1e-3
