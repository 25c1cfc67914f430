"""Rooms of the families in physics, and how right robots that drive in them are about their walls.

python scripts/accuracy/in_physics.py [--seeds 40] [--sensors lds_02]    # rows for rooms of few walls, and of many

A world of `families/convex_room` or `l_room` is run for each seed, with lines and the certified governor. After 5, 10,
20 and 40 scans the normalised error squared is that of one wall that binds a robot, drawn among them; intervals are by
resampling worlds, 95 %.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rooms import normals, wall_errors
from scanning_robot import OTHERS, SENSORS, normalised
from table import print_table

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.estimator import LineEstimator
from pbrg_mj.scenario.load import load_scenario

FAMILIES = ("families/convex_room", "families/l_room")
SCANS = (5, 10, 20, 40)
DURATION = 8.1  # [s] of the slowest sensor's scans
MOST_WALLS = 6
RESAMPLED = 2000


def squares(family: str, sensor: str, seed: int) -> tuple[int, list[float]]:
    """Return how many walls a world has, and normalised errors squared of walls that bind its robots."""
    given = ["estimator.source=beams", "governor.kind=certified", "reference.solver=none"]
    given += [f"seed={seed}", f"sensors.beams.preset={sensor}", f"timing.duration={DURATION}"]
    plan = load_scenario(family, given).scenario
    simulation, random = Simulation.build(plan), np.random.default_rng([seed, 5])
    estimator = simulation.loop.estimator
    assert isinstance(estimator, LineEstimator)
    memory, found, scans = estimator.init(), [], 0
    walls = np.array([[*wall.start, *wall.end, 0.5 * wall.thickness] for wall in plan.world.walls])
    for tick in simulation.control_ticks():
        _, memory = estimator.step(tick.readings, tick.time, memory)
        scans += tick.readings.new_scan
        if tick.readings.new_scan and scans in SCANS:
            for tracks, anchor in zip(memory.tracks, memory.anchors, strict=True):
                bind = tracks[(tracks["live"] == 1) & (tracks["confirmed"] == 1)]
                if len(bind):
                    track = bind[int(random.integers(len(bind)))]
                    error = face_errors(track, np.array([anchor["x"], anchor["y"]]), walls)
                    found += [] if error is None else [normalised(error, track, estimator.setup)]
    return len(walls), found


def face_errors(track: np.void, place: np.ndarray, walls: np.ndarray) -> np.ndarray | None:
    """Do what `wall_errors` does for the seen faces of `walls` (w, 5), centre lines and half thicknesses [m]."""
    a, b = walls[:, :2], walls[:, 2:4]
    outward = normals(a, b)
    outward *= np.sign(outward @ [np.cos(track["angle"]), np.sin(track["angle"])])[:, None]
    inward = -walls[:, 4:] * outward
    return wall_errors(track, place, a + inward, b + inward, outward)


def rows_of(sensor: str, seeds: int) -> Iterator[list[str]]:
    """A row for convex rooms of up to MOST_WALLS walls, one for those of more, and one for rooms like an L."""
    random = np.random.default_rng(1)
    for family in FAMILIES:
        worlds = [squares(family, sensor, seed) for seed in range(1, seeds + 1)]
        for more in (False, True):
            some = [found for walls, found in worlds if (walls > MOST_WALLS) == more and found]
            if some:
                picked = random.integers(len(some), size=(RESAMPLED, len(some)))
                means = [np.mean(np.concatenate([some[k] for k in pick])) for pick in picked]
                low, high = np.quantile(means, [0.025, 0.975])
                every = np.concatenate(some)
                cells = [str(len(some)), str(len(every)), f"{every.mean():.2f} [{low:.2f}, {high:.2f}]"]
                cells += [f"{np.median(every):.2f}"]
                yield [sensor, family, f"{MOST_WALLS + 1} or more" if more else f"up to {MOST_WALLS}", *cells]


if __name__ == "__main__":
    columns, sensors = ["sensor", "family", "walls", "worlds", "errors", "NEES", "median"], (*SENSORS, *OTHERS)
    print_table(__doc__, columns, rows_of, 40, sensors, sensors)
