"""Two governors on the same ticks of a run."""

from __future__ import annotations

from collections.abc import Iterator

from pbrg_mj.governor.problem.interface import Governor, Solution
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.schema import Scenario


def answers(scenario: Scenario, one: Governor, other: Governor) -> Iterator[tuple[Solution, Solution]]:
    """Yield what both answer to each tick's problem; neither drives the team."""
    ours = theirs = None
    for tick in Simulation.build(scenario).control_ticks():
        ours = one.init(tick.problem) if ours is None else ours
        theirs = other.init(tick.problem) if theirs is None else theirs
        (first, ours), (second, theirs) = one.step(tick.problem, ours), other.step(tick.problem, theirs)
        yield first, second
