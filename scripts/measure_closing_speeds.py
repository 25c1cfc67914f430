"""How fast robots think that moving boxes come, and that what stands does, in worlds of `measure_other_worlds.py`.

python scripts/measure_closing_speeds.py [moving 20001-20300] [static 20001-20150] [processes=2]

Worlds run in closed loop under the recommended set-up. In every scan counts, of each robot and each box within half a
metre of its hand point, how fast the box comes nearer to where the robot is, and the largest closing speed of the
half-spaces within 37 degrees of its direction. In static worlds counts how many half-spaces have a closing speed. The
result is in docs/moving-obstacles.md.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from measure_other_worlds import loaded

from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.world.scene.footprints import signed_distance
from pbrg_mj.world.scene.obstacles import moving_footprints

WITHIN, TOWARDS = 0.5, 0.8  # [m], cosine of 37 deg
SPEEDS = ((0.04, 0.1), (0.1, 0.18), (0.18, 0.3))  # [m/s]
SLOW, FAST = 0.05, 0.1  # [m/s] of a wrong closing speed
STEP, INSTANT = 1e-4, 0.01  # [m], [s] of differences
SENSORS = ("generic", "robotarium", "tof_ring", "lidar", "tof_cones", "lds_02")
DEFAULT = ("moving", "20001-20300", "static", "20001-20150")


class Seen(NamedTuple):
    """What one robot's scans of a world had to tell."""

    boxes: list[tuple[float, float]]  # how fast one came, and how fast it was thought to [m/s]
    half_spaces: int
    moving: int  # of these


def comes(box: MovingBox, place: np.ndarray, time: float) -> tuple[float, float, np.ndarray]:
    """Return how far a box is from a place (2,) [m], how fast it comes nearer [m/s], and its direction (2,)."""
    around = place + STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    here, right, left, up, down = signed_distance(around, moving_footprints([box], time)).min(axis=1)
    before, after = (
        float(signed_distance(place[None], moving_footprints([box], at)).min()) for at in (time - INSTANT, time)
    )
    return float(here), (before - after) / INSTANT, np.array([left - right, down - up]) / (2.0 * STEP)


def run(job: tuple[str, int]) -> tuple[str, str, Seen]:
    """Return the kind of a world, its sensor and what was seen in it."""
    kind, seed = job
    scenario = loaded(kind, seed).settings
    none = scenario.reference.model_copy(update={"solver": "none"})
    simulation, seen, half_spaces, moving = Simulation.build(scenario.model_copy(update={"reference": none})), [], 0, 0
    for tick in simulation.control_ticks():
        if not tick.readings.new_scan or tick.time < INSTANT:
            continue
        spaces, places = tick.half_spaces, simulation.loop.world.truth().hand_world
        half_spaces += np.count_nonzero(spaces.active)
        moving += np.count_nonzero(spaces.active & (spaces.closing_speeds > 0.0))
        for j, place in enumerate(places):
            for box in scenario.world.moving_boxes:
                distance, speed, direction = comes(box, place, tick.time)
                faces = spaces.active[j] & (spaces.G[j] @ direction > TOWARDS)
                if distance < WITHIN and faces.any():
                    seen.append((speed, float(spaces.closing_speeds[j][faces].max())))
    return kind, scenario.sensors.beams.preset, Seen(seen, half_spaces, moving)


def shares(boxes: np.ndarray) -> list[str]:
    """Return the cells for boxes (B, 2), how fast each came and was thought to."""
    cells = []
    for low, high in SPEEDS:
        true, told = boxes[(boxes[:, 0] > low) & (boxes[:, 0] <= high)].T
        one = (told == 0.0, told < true - SLOW, told > true + FAST)
        cells.append(f"{len(true)}: " + ", ".join(f"{100.0 * part.mean():.1f}" for part in one) if len(true) else "-")
    return cells


def main(arguments: list[str]) -> None:
    keys = dict(one.split("=", 1) for one in arguments if "=" in one)
    given = [one for one in arguments if "=" not in one] or list(DEFAULT)
    jobs = [(kind, seed) for kind, seeds in zip(given[::2], given[1::2], strict=True) for seed in seeds_of(seeds)]
    found: dict[tuple[str, str], list[Seen]] = defaultdict(list)
    with multiprocessing.get_context("spawn").Pool(int(keys.get("processes", 1))) as pool:
        for kind, sensor, seen in pool.imap_unordered(run, jobs):
            found[kind, sensor].append(seen)
            found[kind, "all"].append(seen)
    heads = [f"comes at {low} to {high} m/s" for low, high in SPEEDS]
    print(f"| sensor | {' | '.join(heads)} | half-spaces at rest that seem to move |\n|{'---|' * (len(SPEEDS) + 2)}")
    for sensor in ("all", *SENSORS):
        boxes = np.array([one for seen in found["moving", sensor] for one in seen.boxes]).reshape(-1, 2)
        count, moving = (
            sum(getattr(one, name) for one in found["static", sensor]) for name in ("half_spaces", "moving")
        )
        rest = f"{100.0 * moving / count:.1f} % of {count}" if count else "-"
        print(f"| {sensor} | {' | '.join(shares(boxes))} | {rest} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
