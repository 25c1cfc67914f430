"""Random teams in physics with and without `control.separation`: how often robots touch, and how soon they are settled.

python scripts/measure_distances.py [--first SEED] [--teams N] [--duration S] [--jobs N] [KEY=VALUE ...]

3 to 5 robots on a ring stand anywhere in a square and are to make any formation; half of the teams have a wall beside
them, which may be in the way. A team is settled when no robot is farther than 5 cm from the formation about the team's
centre, for the rest of the run.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import yaml

import pbrg_mj as pbrg
from pbrg_mj.loop.simulation import Simulation

SQUARE, NEAREST_START = 1.2, 0.35  # half a side, and between two hand points [m]
FORMATION, NEAREST = 1.0, 0.45  # likewise of formations
SETTLED = 0.05  # [m]
Z = 1.96  # of the interval of a rate: 95 %


class Outcome(NamedTuple):
    """What one run showed."""

    touched: bool
    nearest: float  # between two bodies' centres [m]
    wall_margin: float  # least [m]; inf without walls
    settled: float  # [s]; inf if not


def points(rng: np.random.Generator, n: int, half_side: float, nearest: float) -> np.ndarray:
    """Return n points (n, 2) in a square about 0, none nearer to another than `nearest`."""
    while True:
        drawn = rng.uniform(-half_side, half_side, (n, 2))
        if distances(drawn).min() > nearest:
            return drawn


def distances(places: np.ndarray) -> np.ndarray:
    """Return the distances between any two of the places (n, 2)."""
    i, j = np.triu_indices(len(places), 1)
    return np.linalg.norm(places[i] - places[j], axis=1)


def team(seed: int) -> dict[str, Any]:
    """Return the keys of a random team."""
    rng = np.random.default_rng([seed, 77])
    n = int(rng.integers(3, 6))
    formation = points(rng, n, FORMATION, NEAREST)
    start, reference = points(rng, n, SQUARE, NEAREST_START), rng.uniform(-1.5, 1.5, 2)
    heading, leader, walls = rng.uniform(-180, 180, n), int(rng.integers(n)) + 1, []
    if rng.random() < 0.5:
        turn = rng.uniform(0, 2 * np.pi)
        normal = np.array([math.cos(turn), math.sin(turn)])
        along = np.array([-normal[1], normal[0]])
        beyond = normal * max((start @ normal).max() + 0.3, rng.uniform(1.2, 2.0))
        walls = [{"from": (beyond + 5 * along).tolist(), "to": (beyond - 5 * along).tolist(), "thickness": 0.1}]
    return {
        "seed": seed,
        "team.start": start.tolist(),
        "team.heading_deg": heading.tolist(),
        "team.formation": (formation - formation.mean(axis=0)).tolist(),
        "team.leaders": [leader],
        "world.walls": walls,
        "sensors.beams.robots": "all",
        "operator.reference": reference.tolist(),
        "governor": {"kind": "certified"},
        "reference.solver": "none",
    }


def outcome(seed: int, separation: str | None, duration: float, others: dict[str, Any]) -> Outcome:
    """Run one team; `others` are keys for all teams."""
    keys = team(seed) | {"control.separation": separation} | others
    simulation = Simulation.build(pbrg.load("paper/experiment_near", keys, duration=duration).settings)
    scenario = simulation.loop.scenario
    formation, truths, errors = np.array(scenario.team.formation), [], []
    for _ in simulation.control_ticks():
        truths.append(simulation.loop.world.truth())
        p = truths[-1].hand_world - formation
        errors.append(np.linalg.norm(p - p.mean(axis=0), axis=1).max())
    late = np.flatnonzero(np.array(errors) > SETTLED)
    last = int(late[-1]) + 1 if len(late) else 0
    return Outcome(
        touched=any(truth.robot_contact.any() for truth in truths),
        nearest=min(float(distances(truth.body_pose[:, :2]).min()) for truth in truths),
        wall_margin=min(float(truth.wall_margin.min()) for truth in truths),
        settled=last * scenario.timing.tick if last < len(errors) else math.inf,
    )


def wilson(count: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate."""
    rate, spread = count / of, Z**2 / of
    middle, half = rate + spread / 2, Z * math.sqrt(rate * (1 - rate) / of + spread / (4 * of))
    return (middle - half) / (1 + spread), (middle + half) / (1 + spread)


def lines(found: list[Outcome]) -> Iterator[str]:
    """Yield what is told of all runs of one kind."""
    n, touched = len(found), sum(one.touched for one in found)
    low, high = wilson(touched, n)
    yield f"robots touch in {touched} of {n} ({100 * low:.0f} to {100 * high:.0f} %)"
    yield f"nearest bodies' centres {min(one.nearest for one in found):.3f} m"
    crossed = sum(one.wall_margin < 0 for one in found)
    yield f"a wall's clearance is entered in {crossed}, least margin {min(one.wall_margin for one in found):.3f} m"
    settled = sorted(one.settled for one in found)
    yield f"settled {sum(map(math.isfinite, settled))} of {n}, median {settled[n // 2]:.1f} s, last {settled[-1]:.1f} s"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--teams", type=int, default=40)
    parser.add_argument("--duration", type=float, default=12.0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("keys", nargs="*", metavar="KEY=VALUE", help="of all teams")
    given = parser.parse_args()
    others = {key: yaml.safe_load(value) for key, value in (text.split("=", 1) for text in given.keys)}
    seeds = range(given.first, given.first + given.teams)
    with ProcessPoolExecutor(given.jobs) as pool:
        for separation in (None, "auto"):
            n = len(seeds)
            found = list(pool.map(outcome, seeds, [separation] * n, [given.duration] * n, [others] * n))
            print(f"control.separation: {separation or 'null'}", *lines(found), sep="\n    ")


if __name__ == "__main__":
    main()
