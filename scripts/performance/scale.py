"""Large teams in physics, and the governor alone for a thousand robots."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.loop.record import Timings
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.schema import Scenario
from performance.rounds import FLOW, ring_problem
from performance.timing import seconds

COLUMNS = {5: 5, 20: 5, 50: 10, 100: 10}  # of the grid, by robots
APART = 0.35  # [m]
TICKS = 200
THOUSAND = 1000


@dataclass(frozen=True)
class Speed:
    """A team's speed against real time, and the mean time of each stage a tick [us]."""

    robots: int
    real_time_factor: float
    stages_us: dict[str, float]


def grid(robots: int) -> Scenario:
    """Return a grid of robots before a wall; every robot has beams, and links to the next in its row and column."""
    columns = COLUMNS[robots]
    places = [(APART * (j % columns), APART * (j // columns)) for j in range(robots)]
    rows = [(j, j + 1) for j in range(robots) if (j + 1) % columns]
    pairs = rows + [(j, j + columns) for j in range(robots - columns)]
    wall = APART * (columns - 1) + 1.5
    plan: dict[str, Any] = {
        "timing": {"duration": 0.01 * TICKS},
        "team": {"start": places, "formation": places, "leaders": [robots]},
        "graph": {"kind": "edges", "edges": [(a + 1, b + 1) for a, b in pairs]},
        "world": {"walls": [{"from": (wall, -20.0), "to": (wall, 20.0), "thickness": 0.1}]},
        "operator": {"reference": (3.0, 0.0)},
        "governor": {"rounds": 10, "alpha": 2.0, "initial": "start"},
        "reference": {"solver": "none"},
    }
    return Scenario.model_validate(plan)


def team_speeds() -> list[Speed]:
    """Return the speed of teams of all sizes, without log and reference, all robots with 72 beams at 10 Hz."""
    return [_speed(robots) for robots in COLUMNS]


def _speed(robots: int) -> Speed:
    scenario = grid(robots)
    records = Simulation.build(scenario).records()
    next(records)
    begin = perf_counter()
    spent = [record.timings for record in records]
    total = perf_counter() - begin
    stages = {name: float(np.mean([getattr(one, name) for one in spent])) for name in Timings._fields}
    stages["other"] = total / TICKS - sum(stages.values())
    per_tick = {name: 1e6 * mean for name, mean in stages.items() if mean > 1e-7}
    return Speed(robots, TICKS * scenario.timing.tick / total, per_tick)


def round_of_a_thousand_robots() -> float:
    """Return the time of one round of a thousand robots on a ring [s]."""
    problem, estimates = ring_problem(THOUSAND)
    # The first two write into memory that the system has yet to give.
    few = [seconds(lambda: run_rounds(problem, estimates, FLOW, 2)) for _ in range(3)]
    more = [seconds(lambda: run_rounds(problem, estimates, FLOW, 7)) for _ in range(3)]
    return (min(more) - min(few)) / 5
