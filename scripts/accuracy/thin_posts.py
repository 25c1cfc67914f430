"""How often points keep a robot off a thin post that it drives towards.

python scripts/accuracy/thin_posts.py [--seeds 200] [--sensors tof_ring robotarium]    # the table of docs/points.md

A robot drives at 0.3 m/s from 1.6 m to 0.2 m before a post of 1.5 to 5 cm radius, passing it by 6 cm or less to either
side, and swings its heading by 8 degrees meanwhile. A wall is 1 m behind every other post. Counted is whether a
half-space keeps the hand point off the place of the post that is nearest, in all scans within 1 m.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from outliers import SENSORS, SLOTS, readings, resampled, scenario
from raycast import Scene
from table import print_table

from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.world.scene.robot import load_robot_model

SPEED, SWING = 0.3, np.radians(8.0)  # [m/s], [rad]
START, END, COUNTED = 1.6, 0.2, 1.0  # [m] from the post's surface
BEHIND = np.array([[4.0, 0.0]])  # the target [m]


def approach(sensor: str, seed: int) -> np.ndarray:
    """Return in which scans within COUNTED a half-space keeps off the post (S,) bool."""
    random, given = np.random.default_rng([6, seed]), scenario(sensor, seed)
    made = PointEstimator(point_parameters(given, load_robot_model()), np.zeros(1, np.int64), np.zeros((1, 2)), SLOTS)
    radius, beside, period = random.uniform(0.015, 0.05), random.uniform(-0.06, 0.06), random.uniform(1.0, 3.0)
    post = np.array([START + radius, beside])
    wall = ((START + 1.0, -4.0, START + 1.0, 4.0),) if seed % 2 else ()
    scene, noise, memory, kept = Scene(wall, ((*post, radius),)), sensor_noise(given), made.init(), []
    frame, distance = 0, START
    while distance > END:
        time = frame / given.sensors.beams.rate_hz
        pose = np.array([SPEED * time, 0.0, SWING * np.sin(2.0 * np.pi * time / period)])
        away = post - pose[:2]
        distance = float(np.linalg.norm(away)) - radius
        nearest = post - radius * away / np.linalg.norm(away)
        known, memory = made.step_towards(readings(given, noise, scene, pose, frame), time, memory, BEHIND)
        if distance <= COUNTED:
            kept.append(bool((known.G[0] @ nearest > known.h[0])[known.active[0]].any()))
        frame += 1
    return np.array(kept)


def rows_of(sensor: str, seeds: int) -> Iterator[list[str]]:
    """The one row of a sensor."""
    found = [approach(sensor, seed) for seed in range(seeds)]
    missed = np.full((seeds, max(len(one) for one in found)), np.nan)
    for row, one in zip(missed, found, strict=True):
        row[: len(one)] = ~one
    forgotten = sum(bool(one.any() and not one[np.argmax(one) :].all()) for one in found)
    never = sum(not one.any() for one in found)
    yield [sensor, str(int(np.sum(~np.isnan(missed)))), resampled(missed), str(forgotten), str(never)]


if __name__ == "__main__":
    columns = ["sensor", "scans", "not kept off, of 1,000", "approaches with a post forgotten", "never seen"]
    print_table(__doc__, columns, rows_of, 200, ("generic", *SENSORS), ("generic", *SENSORS))
