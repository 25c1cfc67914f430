"""Synthetic tick records: seeded random numbers of the right shapes, no run behind them."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.monitor.diagnostics import Diagnostics
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.loop.record import TickRecord, Timings
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import LoadedScenario, parse_scenario
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.team.network import Network
from pbrg_mj.world.plant.interface import Truth

TICK = 0.02  # [s]; ten to a chunk of the log
BEAMS = 8
SCENARIO_YAML = """\
description: Three robots that exist on paper only
seed: 7
timing: {tick: 0.02}
team:
  start: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
  formation: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
  leaders: [1]
world:
  walls:
    - {from: [3.0, -1.0], to: [3.0, 3.0]}
sensors:
  beams: {robots: [1, 3], count: 8}
estimator: {half_spaces_per_robot: 2}
operator: {reference: [1.0, 1.0]}
log: {timings: TIMINGS}
"""


def loaded(*, timings: bool) -> LoadedScenario:
    """Return a scenario of three robots, two of them with beams."""
    text = SCENARIO_YAML.replace("TIMINGS", str(timings).lower())
    return LoadedScenario(scenario=parse_scenario(text, file="three.yaml"), name="three", yaml_text=text)


def records(ticks: int, *, robots: int = 3, slots: int = 2, seed: int = 1) -> list[TickRecord]:
    """Return random records; NaN, -0.0 and infinities among the values, an optimum every tenth tick."""
    rng = np.random.default_rng(seed)
    return [_record(rng, index, robots, slots) for index in range(ticks)]


def _record(rng: np.random.Generator, index: int, n: int, slots: int) -> TickRecord:
    def values(*shape: int) -> np.ndarray:
        return rng.normal(size=shape)

    half_spaces = HalfSpaces(
        values(n, slots, 2), values(n, slots), rng.random((n, slots)) < 0.5, rng.random((n, slots, n)) < 0.5
    )
    rows = slots * n
    network = Network(np.zeros((n, n)), np.zeros(n + 1, np.int64), np.zeros(0, np.int64), np.ones(n))
    hand = values(n, 2)
    hand[0] = (-0.0, np.nan)
    hand[1] = (np.inf, 5e-324)
    return TickRecord(
        index=index,
        time=index * TICK,
        truth=Truth(
            values(n, 3), values(n, 2), values(n, 2), values(n), rng.random(n) < 0.1, *_added(seed=index, robots=n)
        ),
        readings=Readings(values(n, 3), values(2, BEAMS), index % 10 == 0, index // 3, index // 10),
        hand_world=hand,
        half_spaces=half_spaces,
        problem=Problem(network, values(n, 2), values(n, 2), ball_rows(half_spaces, values(n, 2)), values(2)),
        solution=Solution(
            values(n, 2), values(n, rows), "infeasible" if index % 7 == 3 else "ok", 10, rng.integers(0, 2**62, n)
        ),
        operation=Diagnostics(values(2), *values(6).tolist()),
        flow_passivity=Passivity(*values(4).tolist()),
        optimum=_optimum(rng, n, rows) if index % 10 == 0 else None,
        passivity=Passivity(*values(4).tolist()) if index % 10 == 0 else None,
        velocity=values(n, 2),
        command=values(n, 2),
        winding_up=rng.random(n) < 0.1,
        timings=Timings(*rng.random(9).tolist()),
    )


def _added(seed: int, robots: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what logs did not have at first, drawn apart from the rest, which a log of then holds."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=robots), rng.random(robots) < 0.1, rng.random(robots) < 0.1


def _optimum(rng: np.random.Generator, n: int, rows: int) -> Optimum:
    if rng.random() < 0.5:
        empty = np.full((n, rows), np.nan)
        return Optimum(np.full(2, np.nan), "infeasible", np.nan, empty, "Prim\u00e4r infeasible", 1e-3, 2e-3)
    return Optimum(rng.normal(size=2), "solved", -0.0, rng.normal(size=(n, rows)), "Solved", 1e-3, 2e-3)
