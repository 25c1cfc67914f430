"""Random walls that come into view at 1.2 m, one world a seed: which does the team cross, and by how much?

python scripts/late_walls.py [--first SEED] [--worlds N] [--logs DIR] [KEY=VALUE ...]

Without keys the governor is the certified one. Of every world: outcome, least true margin, how near robots come to each
other, and for how long no reference was admissible. A wall counts as crossed where a true margin is negative.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

SIGHT = 1.2  # [m]
LENGTH = 10.0  # [m] of a wall
THICKNESS = 0.1  # [m]
DURATION = 12.0  # [s]
CROSSED = -1e-6  # [m] of the true margin


def world(seed: int) -> list[str]:
    """Return what the seed's world changes in sensing/late_detection: start, wall and reference."""
    random = np.random.default_rng(seed)
    course, slant = random.uniform(-np.pi, np.pi), np.deg2rad(random.uniform(-60.0, 60.0))
    ahead, normal = _direction(course), _direction(course + slant)
    formation = np.array([[-0.5, 0.5], [-0.5, -0.5], [0.0, -0.5], [0.5, -0.5], [0.0, 0.0]])
    start = formation + random.uniform(-0.1, 0.1, formation.shape)
    headings = np.rad2deg(course) + random.uniform(-90.0, 90.0, len(start))
    foremost = (start @ normal).max()
    face = foremost + SIGHT + random.uniform(0.3, 2.5)  # G.x of the wall's face, out of sight at the start
    reference = ahead * (face + random.uniform(0.5, 4.0)) / np.cos(slant)
    along, middle = np.array([-normal[1], normal[0]]), (face + THICKNESS / 2) * normal
    ends = [middle - LENGTH / 2 * along, middle + LENGTH / 2 * along]
    return [
        f"seed={seed}",
        f"timing.duration={DURATION}",
        f"team.start={_listed(start)}",
        f"team.heading_deg={np.round(headings, 3).tolist()}",
        f"world.walls=[{{from: {_listed(ends[0])}, to: {_listed(ends[1])}, thickness: {THICKNESS}}}]",
        f"sensors.beams.range_max={SIGHT}",
        f"operator.reference={_listed(reference)}",
        "log.timings=false",
    ]


def _direction(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def _listed(points: np.ndarray) -> list[float]:
    return np.round(points, 4).tolist()


def measured(seeds: range, overrides: list[str], folder: Path) -> Iterator[tuple[int, RunMetrics]]:
    """Yield what came of every seed's world."""
    for seed in seeds:
        loaded = load_scenario("sensing/late_detection", [*world(seed), *overrides])
        simulation, log = Simulation.build(loaded.scenario), folder / f"late_wall_{seed}.mcap"
        with LogWriter(log, loaded, simulation.model_xml, force=True) as write:
            for record in simulation.records():
                write(record)
        yield seed, metrics(open_run(log))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    options.add_argument("--first", type=int, default=1, help="seed of the first world")
    options.add_argument("--worlds", type=int, default=40, help="how many")
    options.add_argument("--logs", type=Path, help="folder that keeps the logs")
    options.add_argument("overrides", nargs="*", default=["governor.kind=certified"], metavar="KEY=VALUE")
    given = options.parse_args()
    margins, crossed, bumped = [], [], []
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.logs or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        print("seed  margin [m]  robots' gap [m]  infeasible  outcome")
        for seed, found in measured(range(given.first, given.first + given.worlds), given.overrides, folder):
            margin, gap = found.true_margin_min_m, found.robot_gap_min_m
            outcome = f"{found.outcome}: {found.reason}" if found.reason else found.outcome
            print(f"{seed:4d}  {margin:10.3f}  {gap:15.3f}  {found.governor_not_ok_share:10.3f}  {outcome}", flush=True)
            margins.append(margin)
            crossed += [seed] if margin < CROSSED else []
            bumped += [seed] if gap <= 0.0 else []
    print(f"{given.worlds} worlds: crossed {len(crossed)} {crossed}, robots touched {len(bumped)} {bumped}")
    print(f"margin [m]: least {min(margins):.3f}, median {np.median(margins):.3f}")


if __name__ == "__main__":
    main()
