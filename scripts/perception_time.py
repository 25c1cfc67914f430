"""Time perception: one set of scans of all robots to half-spaces, warm, median over the scans of a run.

python scripts/perception_time.py [SCENARIO ...] [KEY=VALUE ...]    # default: one wall, a corner, a corridor and a box

Those with `set_up=recommended` or `estimator.source=points` show the estimator of points, all others that of lines.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from statistics import median
from time import perf_counter

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

DEFAULT = ("sensing/ideal_sensor", "obstacles/corner", "obstacles/corridor", "obstacles/box")
SECONDS = 20  # of each run: some 200 sets of scans
REPEATS = 7


def time_scans(name: str, overrides: Sequence[str] = ()) -> tuple[int, int, float]:
    """Return robots with beams, beams of each, and the median time of one set of scans [s]."""
    plan = load_scenario(name, [f"timing.duration={SECONDS}", "reference.solver=none", *overrides]).scenario
    simulation, m = Simulation.build(plan), None
    estimator, goal_directed, scans = simulation.loop.estimator, simulation.loop.goal_directed, []
    for tick in simulation.control_ticks():
        if tick.readings.new_scan:
            scans.append((tick.readings, tick.time, m))
        m = tick.solution.m
    spent = []
    for _ in range(REPEATS):
        memory = estimator.init()
        for readings, time, held in scans:
            began = perf_counter()
            if goal_directed is None:
                _, memory = estimator.step(readings, time, memory)
            else:
                _, memory = goal_directed.step_towards(readings, time, memory, held)
            spent.append(perf_counter() - began)
    return *scans[0][0].ranges.shape, median(spent)


if __name__ == "__main__":
    keys = [text for text in sys.argv[1:] if "=" in text]
    for name in [text for text in sys.argv[1:] if "=" not in text] or DEFAULT:
        robots, beams, seconds = time_scans(name, keys)
        print(f"{name:<28} {robots} scans of {beams} beams: {seconds * 1e6:.0f} us")
