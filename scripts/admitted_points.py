"""How near to what stands the half-spaces of points let robots in, in physics; prints a table.

python scripts/admitted_points.py 5101-5112 [--sensors generic lds_02] [--families boxes notched] [--processes 2]
python scripts/admitted_points.py 5301-5308 --sensors generic --set sensors.camera.delay=0.06

Worlds of families run for 6 s under the recommended set-up. In every fifth scan after the first second the faces
that a robot sees `within` that distance of its hand point are held against its half-spaces. A place on a face is too
near when they let in a point that is nearer to it than the clearance, by more than 1 cm. What a team-mate hides is not
seen, with a sensor of cones as far as a cone that meets the team-mate goes. Intervals are by resampling worlds, 95 %:
scans of one world show the same things.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from accuracy.raycast import PLATE, Scene, cast_along
from accuracy.table import line
from regions.measures import NOTED
from regions.polygon import cut, distance, inside_disc
from regions.views import ROBOT, scene_of

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.obstacles import footprints, outlines
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.scenario.schema import PRESETS, Scenario

SENSORS = ("generic", *PRESETS)
FAMILIES = ("notched", "boxes", "columns", "boards", "clutter")  # all at rest
COLUMNS = ("sensor", "scans of a robot", "too near in", "share [95 %]", "in worlds", "by at most [cm]", "families")
DURATION, FROM, EVERY = 6.0, 1.0, 5  # [s], [s], scans
STEP = 0.02  # [m] between places on a face
EDGE = 1e-3  # of the way to a place: that a beam ends there, and not before
RESAMPLED = 2000  # times
REACH = 3.0  # [m] of the polygon that half-spaces are cut from, more than any place is off


class Look(NamedTuple):
    """What a robot knows of its surroundings after a scan, and where everybody is."""

    robot: int
    bodies: np.ndarray  # (n, 3) true poses
    hand: np.ndarray  # (2,) [m]
    G: np.ndarray  # (k, 2) of the half-spaces that bind it
    h: np.ndarray  # (k,) [m]


def looks(run: pbrg.Run) -> Iterator[Look]:
    """Yield what every robot knows after every fifth scan."""
    bodies = np.concatenate([run["body_true_m"], run["heading_true_rad"][..., None]], axis=2)
    scans = np.flatnonzero((np.diff(run["scan_frame"], prepend=-1) > 0) & (run.time_s > FROM))
    for tick in scans[::EVERY]:
        for robot in range(bodies.shape[1]):
            held = run["half_space_active"][tick] & run["half_space_binds"][tick, :, :, robot]
            G, h = run["half_space_G"][tick][held], run["half_space_h_m"][tick][held]
            yield Look(robot, bodies[tick], run.q_true_m[tick, robot], G, h)


def faces(scenario: Scenario) -> np.ndarray:
    """Return places (f, 2) on all faces of what stands [m]."""
    places = []
    for corners in outlines(footprints(scenario)):
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            share = np.linspace(0.0, 1.0, max(2, math.ceil(float(np.linalg.norm(b - a)) / STEP)))
            places.append(a + share[:, None] * (b - a))
    return np.concatenate(places)


def seen(places: np.ndarray, look: Look, solids: Scene, half_cone: float) -> np.ndarray:
    """Return which places (f, 2) beams from the body's centre meet first."""
    body, others = look.bodies[look.robot], np.delete(look.bodies, look.robot, axis=0)[:, :2]
    way = places - body[:2]
    length = np.linalg.norm(way, axis=1)
    angles = np.arctan2(way[:, 1], way[:, 0]) - body[2]
    free = ~(cast_along(solids, body, angles, REACH) < (1.0 - EDGE) * length)
    for mate in others - body[:2]:
        apart = float(np.linalg.norm(mate))
        off = np.abs(np.angle(np.exp(1j * (angles + body[2] - np.arctan2(mate[1], mate[0])))))
        hidden = math.asin(min(PLATE / apart, 1.0)) + 2.0 * half_cone
        free &= (off > hidden) | (length < apart - PLATE)
    return free


def too_near(look: Look, places: np.ndarray, clearance: float) -> float:
    """Return by how much [m] a point is let in that is nearer to a place than the clearance; 0 if none is."""
    behind = np.max(places @ look.G.T - look.h, axis=1, initial=-np.inf)
    near = places[behind < clearance]  # no point that is let in is nearer to the others
    corners = cut(inside_disc(look.hand, REACH), look.G, look.h)
    return max((clearance - distance(place, corners) for place in near), default=0.0)


class World(NamedTuple):
    """What is run: `keys` are KEY=VALUE of the scenario."""

    family: str
    seed: int
    within: float  # [m]
    keys: tuple[str, ...]


def measure(world: World) -> tuple[int, list[float]]:
    """Return in how many scans robots were looked at, and by how much [m] those are too near that are by over NOTED."""
    run = pbrg.run(pbrg.load(f"families/{world.family}", seed=world.seed, duration=DURATION).override(world.keys))
    scenario = run.scenario.settings
    places, solids = faces(scenario), scene_of(footprints(scenario))
    half_cone = 0.5 * math.radians(scenario.sensors.beams.cone_deg)
    count, found = 0, []
    for look in looks(run):
        count += 1
        some = places[np.linalg.norm(places - look.hand, axis=1) < world.within]
        some = some[seen(some, look, solids, half_cone)] if len(some) else some
        by = too_near(look, some, ROBOT.clearance) if len(some) else 0.0
        if by > NOTED:
            found.append(by)
    return count, found


def share(scans: np.ndarray, near: np.ndarray) -> str:
    """Return the share of scans (worlds,) that are too `near` (worlds,), with its interval by resampling worlds.

    Where none is too near, that tells no interval.
    """
    if not near.any():
        return "0"
    random = np.random.default_rng(0)
    drawn = random.integers(0, len(scans), (RESAMPLED, len(scans)))
    low, high = np.quantile(near[drawn].sum(axis=1) / scans[drawn].sum(axis=1), [0.025, 0.975])
    return f"{near.sum() / scans.sum():.2%} [{100 * low:.2f}, {100 * high:.2f}]".replace("%", " %")


def row(sensor: str, worlds: list[World], measured: list[tuple[int, list[float]]]) -> str:
    """Return a row of the table."""
    scans, near = np.array([count for count, _ in measured]), np.array([len(found) for _, found in measured])
    most = max((by for _, found in measured for by in found), default=0.0)
    counts: Counter[str] = Counter()
    for world, found in zip(worlds, near, strict=True):
        counts[world.family] += int(found)
    where = ", ".join(f"{family} {count}" for family, count in counts.items() if count)
    numbers = str(scans.sum()), str(near.sum()), share(scans, near), str(np.count_nonzero(near))
    return line([sensor, *numbers, f"{100 * most:.1f}", where or "-"])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("seeds", help="of the worlds, for example 5101-5112 or 5201-5224,5401-5448")
    options.add_argument("--sensors", nargs="+", default=SENSORS, metavar="NAME")
    options.add_argument("--families", nargs="+", default=FAMILIES, metavar="NAME")
    options.add_argument("--within", type=float, default=1.0, help="[m] of the hand point")
    options.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="of the scenario")
    options.add_argument("--processes", type=int, default=1, help="worlds at a time")
    given = options.parse_args()
    print(f"{line(COLUMNS)}\n|{'---|' * len(COLUMNS)}")
    with multiprocessing.get_context("spawn").Pool(given.processes) as pool:
        for sensor in given.sensors:
            keys = ("set_up=recommended", f"sensors.beams.preset={sensor}", "reference.solver=none", *given.set)
            families, seeds = given.families, seeds_of(given.seeds)
            worlds = [World(family, seed, given.within, keys) for family in families for seed in seeds]
            print(row(sensor, worlds, pool.map(measure, worlds, chunksize=1)), flush=True)


if __name__ == "__main__":
    main()
