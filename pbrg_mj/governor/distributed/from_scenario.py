"""The paper's flow with a scenario's gains, step and multiplier cap."""

from __future__ import annotations

import math

from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.penalty import exact_multiplier_cap
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Channel


def round_step(scenario: Scenario) -> float:
    """Return the step of one communication round [s]: as given, or so that the rounds of a tick cover the tick."""
    settings = scenario.governor
    return scenario.timing.tick / settings.rounds if settings.step is None else settings.step


def multiplier_cap(scenario: Scenario) -> float:
    """Return mu [m]: as given, inf for null, or for `auto` so large that the penalty is exact (`penalty`)."""
    settings = scenario.governor
    if settings.multiplier_cap == "auto":
        return exact_multiplier_cap(scenario.robots, len(scenario.team.leaders), settings.reference_range)
    return math.inf if settings.multiplier_cap is None else settings.multiplier_cap


def flow(scenario: Scenario) -> Flow:
    """Return the flow's gains."""
    proximal = scenario.governor.integration == "proximal"
    return Flow(scenario.governor.alpha, round_step(scenario), multiplier_cap(scenario), proximal)


def paper_flow(scenario: Scenario, lines: Channel | None) -> DistributedGovernor:
    """Return the paper's governor, with messages over a channel where there is one."""
    settings = scenario.governor
    return DistributedGovernor(
        flow=flow(scenario),
        rounds=settings.rounds,
        initial=settings.initial,
        channel=lines,
        diverged_beyond=scenario.divergence_limit,
        backend="numpy" if settings.backend == "numpy" else "compiled",
    )
