"""What it costs to assume the wrong sensors: `estimator.assumed` against `sensors`.

python scripts/accuracy/assumed.py [--seeds 60] [--sensors generic]      # the table of docs/perception-accuracy.md

A robot drives in convex rooms as in rooms.py. After ten scans: the normalised error squared of a wall, how many of all
half-spaces let the hand point, straight ahead, nearer to their wall than the clearance, and by how much at worst.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rooms import Drive, convex_room, way
from scanning_robot import CLEARANCE, HAND, SENSORS
from table import print_table

from pbrg_mj.scenario.schema import Beams, Camera, Scenario

SCANS = 10
CAMERA = Camera()
CASES = ("as it is", "beams' noise twice", "half", "camera's noise three times", "bias", "camera late")


def scenario_of(sensor: str, case: str, seed: int) -> Scenario:
    """A robot whose sensors are what `case` says, and who assumes the preset and the default camera."""
    preset = Beams(preset=sensor)  # pyright: ignore[reportArgumentType]
    nominal = {"noise_std": preset.noise_std, "noise_ratio": preset.noise_ratio}
    known = {"position_std": CAMERA.position_std, "heading_std_deg": CAMERA.heading_std_deg, "delay": 0.0}
    beams: dict[str, Any] = {"preset": sensor}
    camera: dict[str, Any] = {}
    if case in ("beams' noise twice", "half"):
        beams |= {name: (2.0 if case != "half" else 0.5) * value for name, value in nominal.items()}
    elif case == "camera's noise three times":
        camera = {name: 3.0 * known[name] for name in ("position_std", "heading_std_deg")}
    elif case == "bias":
        camera = {"bias_x": 0.005, "heading_bias_deg": 0.5}
    elif case == "camera late":
        camera = {"delay": 0.1}
    given = {
        "seed": seed * len(SENSORS) + SENSORS.index(sensor),
        "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
        "operator": {"reference": (0, 0)},
        "sensors": {"beams": beams, "camera": camera},
        "estimator": {"assumed": {"beams": nominal, "camera": known}},
    }
    return Scenario.model_validate(given)


def evaluate(sensor: str, case: str, seed: int) -> tuple[float, list[float]]:
    """The normalised error squared of one wall, NaN for none, and by how much [m] half-spaces let in too far."""
    given = scenario_of(sensor, case, seed)
    random = np.random.default_rng([seed, 3])
    corners = convex_room(random)
    start, speed, turn = way(random, corners, SCANS / given.sensors.beams.rate_hz)
    robot = Drive(given, corners, start, speed, turn)
    for _ in range(SCANS):
        robot.scan()
    found = robot.errors()
    square = found[int(random.integers(len(found)))][2] if found else np.nan
    pose = robot.pose((SCANS - 1) / given.sensors.beams.rate_hz)
    hand = pose[:2] + HAND * np.array([np.cos(pose[2]), np.sin(pose[2])])
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    known, too_far = robot.memory.half_spaces, []
    for k in np.flatnonzero(known.active[0]).tolist():
        G, h = known.G[0, k], known.h[0, k]
        foot = hand + (h - G @ hand) * G
        of = int(np.argmax(outward @ G))  # the wall most alike
        too_far.append(CLEARANCE - float(outward[of] @ (corners[of] - foot)))
    return square, too_far


def rows_of(sensor: str, seeds: int) -> Iterator[list[str]]:
    """A row for each of CASES."""
    for case in CASES:
        results = [evaluate(sensor, case, seed) for seed in range(seeds)]
        squares = np.array([square for square, _ in results])
        too_far = np.concatenate([far for _, far in results])
        worst = max(1000 * too_far.max(), 0.0)
        share = f"{np.mean(too_far > 0):.1%}"
        yield [sensor, case, f"{np.nanmean(squares):.1f}", share, str(len(too_far)), f"{worst:.0f}"]


if __name__ == "__main__":
    columns = ["sensor", "truly", "NEES", "too near", "half-spaces", "worst [mm]"]
    print_table(__doc__, columns, rows_of, 60, ["generic", "robotarium"])
