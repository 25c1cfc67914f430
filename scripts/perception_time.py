"""Time perception: one set of scans of all robots to half-spaces, warm, median over the scans of a run.

python scripts/perception_time.py [SCENARIO ...]    # default: scenes of one wall, a corner, a corridor and a box
"""

from __future__ import annotations

import sys
from statistics import median
from time import perf_counter

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.scenario.load import load_scenario

DEFAULT = ("sensing/ideal_sensor", "obstacles/corner", "obstacles/corridor", "obstacles/box")
SECONDS = 20  # of each run: some 200 sets of scans
REPEATS = 7


def time_scans(name: str) -> tuple[int, int, float]:
    """Return robots with beams, beams of each, and the median time of one set of scans [s]."""
    plan = load_scenario(name, [f"timing.duration={SECONDS}", "reference.solver=none"]).scenario
    simulation = Simulation.build(plan)
    setup = simulation.loop.estimator.setup
    scans = [(r.readings, r.time) for r in simulation.records() if r.readings.new_scan]
    spent = []
    for _ in range(REPEATS):
        memory = initial(setup)
        for readings, time in scans:
            began = perf_counter()
            _, memory = perceive(readings, time, memory, setup)
            spent.append(perf_counter() - began)
    return *scans[0][0].ranges.shape, median(spent)


if __name__ == "__main__":
    for name in sys.argv[1:] or DEFAULT:
        robots, beams, seconds = time_scans(name)
        print(f"{name:<28} {robots} scans of {beams} beams: {seconds * 1e6:.0f} us")
