"""What outliers do to the half-space of points before a wall, and in the open.

python scripts/accuracy/outliers.py [--seeds 400] [--sensors robotarium tof_ring]    # the table of docs/points.md

A robot rests 0.5 to 1.5 m before a wall of a room, some heading, and scans 24 times, once with outliers and once with
the range that each of these beams would have read. Perception takes them for as frequent as they are, both times.
Compared is how far straight ahead to the wall the half-spaces let its hand point go, from the fifth scan on. Where
nothing is in sight it scans 250 times: half-spaces arise where outliers pass for a thing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from raycast import Scene, cast
from scanning_robot import HAND
from table import print_table

from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.scene.robot import load_robot_model

SENSORS = ("robotarium", "tof_ring", "lidar", "lds_02")  # presets with outliers whose beams are rays
SCANS, SETTLED = 24, 4  # of a robot, and the first ones that do not count
OPEN_SCANS = 250  # of a robot in the open
SLOTS = 8
TARGET = np.array([[3.0, 0.0]])  # behind the wall [m]
FARTHEST = 1.6  # [m] beyond it no half-space is of the wall
NEARER = (0.03, 0.1, 0.2)  # [m]


def scenario(sensor: str, seed: int) -> Scenario:
    """A robot by itself that perceives points."""
    given = {
        "seed": seed,
        "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
        "operator": {"reference": (0, 0)},
        "sensors": {"beams": {"preset": sensor}},
        "estimator": {"source": "points", "scope": "own", "half_spaces_per_robot": SLOTS},
    }
    return Scenario.model_validate(given)


def room(distance: float) -> Scene:
    """A room of 4 m, one of whose walls is so far ahead [m]."""
    sides = ((distance, -2.0, distance, 2.0), (-2.0, 2.0, distance, 2.0), (-2.0, -2.0, distance, -2.0))
    return Scene((*sides, (-2.0, -2.0, -2.0, 2.0)))


def readings(given: Scenario, noise: SensorNoise, scene: Scene, pose: np.ndarray, frame: int) -> Readings:
    """What the robot reads at a true pose (3,)."""
    raw = np.nan_to_num(cast(scene, pose, given.sensors.beams.count, noise.range_max), nan=-1.0)
    raw[raw < given.sensors.beams.range_min] = -1.0
    ranges = noisy_scan(raw, noise, stream(noise.seed, Source.BEAMS, 0, frame))
    draw = stream(noise.seed, Source.CAMERA, 0, frame).standard_normal(3)
    seen = pose + draw * [noise.position_std, noise.position_std, noise.heading_std]
    pictures = given.sensors.camera.rate_hz / given.sensors.beams.rate_hz
    return Readings(seen[None], ranges[None], True, int(np.ceil(frame * pictures - 1e-9)), frame)


def ahead(known: HalfSpaces, pose: np.ndarray) -> float:
    """How far straight ahead the half-spaces let the hand point go [m]; infinite where none ends it."""
    hand = pose[:2] + HAND * np.array([np.cos(pose[2]), np.sin(pose[2])])
    towards = known.active[0] & (known.G[0, :, 0] > 1e-6)
    left = (known.h[0] - known.G[0] @ hand)[towards] / known.G[0, towards, 0]
    return float(left.min(initial=np.inf))


def estimator(given: Scenario) -> PointEstimator:
    """What such a robot perceives with."""
    return PointEstimator(point_parameters(given, load_robot_model()), np.zeros(1, np.int64), np.zeros((1, 2)), SLOTS)


def arising_in_the_open(sensor: str, seed: int) -> int:
    """How often half-spaces arise in OPEN_SCANS scans of a robot at rest where nothing is."""
    given = scenario(sensor, seed)
    made, noise, pose = estimator(given), sensor_noise(given), np.zeros(3)
    memory, before, found = made.init(), True, 0  # the first scan may have to wait for its frames
    for frame in range(OPEN_SCANS):
        read = readings(given, noise, Scene(), pose, frame)
        known, memory = made.step_towards(read, frame / given.sensors.beams.rate_hz, memory, TARGET)
        found += bool(known.active.any()) and not before
        before = bool(known.active.any())
    return found


def nearer(sensor: str, seed: int) -> np.ndarray:
    """How much nearer outliers make half-spaces (SCANS - SETTLED,) [m]; NaN where without them none is of the wall."""
    random, given = np.random.default_rng([5, seed]), scenario(sensor, seed)
    made = estimator(given)
    scene, pose = room(random.uniform(0.5, 1.5)), np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)])
    noise, memories, found = sensor_noise(given), [made.init(), made.init()], []
    for frame in range(SCANS):
        reach = []
        for k, of in enumerate((replace(noise, outliers=0.0), noise)):
            read = readings(given, of, scene, pose, frame)
            time = frame / given.sensors.beams.rate_hz
            known, memories[k] = made.step_towards(read, time, memories[k], TARGET)
            reach.append(ahead(known, read.body_pose[0]))
        found.append(reach[0] - reach[1] if reach[0] < FARTHEST else np.nan)
    return np.array(found[SETTLED:])


def resampled(hits: np.ndarray) -> str:
    """The rate of hits (robots, scans) in a thousand scans, with 95 % by resampling robots."""
    random = np.random.default_rng(0)
    rates = [np.nanmean(hits[random.integers(0, len(hits), len(hits))]) for _ in range(400)]
    low, high = 1000 * np.quantile(rates, [0.025, 0.975])
    return f"{1000 * np.nanmean(hits):.0f} [{low:.0f}, {high:.0f}]"


def rows_of(sensor: str, seeds: int) -> Iterator[list[str]]:
    """The one row of a sensor."""
    found = np.array([nearer(sensor, seed) for seed in range(seeds)])
    none = np.isnan(found)
    rates = [resampled(np.where(none, np.nan, found > by)) for by in NEARER]
    farther = resampled(np.where(none, np.nan, found < -0.01))
    arising = sum(arising_in_the_open(sensor, seed) for seed in range(seeds))
    in_the_open = f"{arising} of {OPEN_SCANS * seeds}"
    yield [sensor, str(int(np.sum(~none))), *rates, f"{np.nanmax(found):.2f}", farther, in_the_open]


if __name__ == "__main__":
    by = [f"nearer by {100 * by:.0f} cm" for by in NEARER]
    columns = ["sensor", "scans", *by, "most [m]", "farther by 1 cm", "arising in the open"]
    print_table(__doc__, columns, rows_of, 400, SENSORS, SENSORS)
