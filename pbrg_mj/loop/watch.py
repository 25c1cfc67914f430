"""What a run tells of its ticks besides what the robots do: certificates, wind-up, the centralized optimum.

Nothing here is fed back. So ticks are watched some at a time, after they have passed: see `Simulation.records`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import CentralizedSolver, Optimum
from pbrg_mj.governor.monitor.diagnostics import Diagnostics, diagnose
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.monitor.tick_block import TickBlock, stack_ticks
from pbrg_mj.loop.record import TickRecord, Timings
from pbrg_mj.loop.tick import Decision
from pbrg_mj.team.wind_up import WindUpDetector, WindUpState, wind_up
from pbrg_mj.world.plant.interface import Truth

SIDE_BY_SIDE = 300_000  # bytes of a block's estimates: a hundred ticks of five robots, one of forty


@dataclass(frozen=True)
class Watch:
    """How ticks are evaluated."""

    wind_up_rule: WindUpDetector
    passivities: Callable[[TickBlock, Sequence[Any], Sequence[Optimum]], list[Passivity]]  # about optima
    flow_passivities: Callable[[TickBlock, Sequence[Any]], list[Passivity]]  # of the governor's own velocity
    reference_solver: CentralizedSolver | None
    reference_every: int  # ticks


class Watched(NamedTuple):
    """What the next ticks' judgement needs of those before."""

    wind_up: WindUpState | None = None  # None before the first tick
    operation: Diagnostics | None = None  # likewise


class Passed(NamedTuple):
    """A tick that has passed: the world as it was, what was decided, and how long looking and moving on took [s]."""

    truth: Truth
    decision: Decision
    looking: float
    advancing: float


def judge(watch: Watch, before: Watched, passed: Sequence[Passed]) -> tuple[Watched, list[TickRecord]]:
    """Return the records of ticks in a row, one or more, and what the judgement of those after them needs.

    Ticks of a small team are evaluated all at once: a call then costs them little. Of a large one, laying the arrays of
    two ticks side by side takes longer than a call.
    """
    n, records = passed[0].decision.problem.network.robots, []
    ticks = max(1, SIDE_BY_SIDE // (3 * 8 * n * (4 * n + 2)))  # z, zeta, and about as many multipliers
    for first in range(0, len(passed), ticks):
        before, evaluated = _judge(watch, before, passed[first : first + ticks])
        records += evaluated
    return before, records


def _judge(watch: Watch, before: Watched, passed: Sequence[Passed]) -> tuple[Watched, list[TickRecord]]:
    """Judge a block of ticks, one stage for all of them before the next one, while its code is in the caches."""
    began, decisions = perf_counter(), [one.decision for one in passed]
    block = TickBlock.of([one.problem for one in decisions])
    before, certified = _certify(watch, before, block, decisions)
    certifying = (perf_counter() - began) / len(passed)
    solved = [_optimum(watch, one) for one in decisions]
    began = perf_counter()
    balances = _balances(watch, block, decisions, [optimum for optimum, _ in solved])
    balancing = (perf_counter() - began) / max(sum(one is not None for one in balances), 1)
    return before, [
        _record(one, marks, optimum, balance, (certifying, solving, balancing))
        for one, marks, (optimum, solving), balance in zip(passed, certified, solved, balances, strict=True)
    ]


class _Marks(NamedTuple):
    """Certificates of one tick."""

    winding: np.ndarray
    operation: Diagnostics
    flow: Passivity


def _certify(
    watch: Watch, before: Watched, block: TickBlock, decisions: Sequence[Decision]
) -> tuple[Watched, list[_Marks]]:
    p, xi, _ = block.state
    velocity = stack_ticks([one.velocity for one in decisions])
    ways, winding = wind_up(watch.wind_up_rule, before.wind_up, p, xi, velocity)
    m = stack_ticks([one.solution.m for one in decisions])
    multipliers = stack_ticks([one.solution.multipliers for one in decisions])
    evaluated = diagnose(block, m, multipliers, before.operation)
    flows = watch.flow_passivities(block, [one.memory for one in decisions])
    return Watched(ways, evaluated[-1]), list(map(_Marks, winding, evaluated, flows))


def _optimum(watch: Watch, decision: Decision) -> tuple[Optimum | None, float]:
    """Return the optimum, and how long it took in all [s]."""
    if watch.reference_solver is None or decision.index % watch.reference_every:
        return None, 0.0
    began = perf_counter()
    return watch.reference_solver.solve(decision.problem), perf_counter() - began


def _balances(
    watch: Watch, block: TickBlock, decisions: Sequence[Decision], optima: Sequence[Optimum | None]
) -> list[Passivity | None]:
    """Return the passivity balances about the optima, None where there is no optimum to balance about."""
    there = [(decision, optimum) for decision, optimum in zip(decisions, optima, strict=True) if optimum is not None]
    if not there:
        return [None] * len(optima)
    if len(there) < len(decisions):
        block = TickBlock.of([decision.problem for decision, _ in there])
    memories, found = [decision.memory for decision, _ in there], [optimum for _, optimum in there]
    balances = iter(watch.passivities(block, memories, found))
    return [None if optimum is None else next(balances) for optimum in optima]


def _record(
    passed: Passed,
    marks: _Marks,
    optimum: Optimum | None,
    balance: Passivity | None,
    seconds: tuple[float, float, float],
) -> TickRecord:
    """Put a record together; `seconds` went into certificates, the optimum and the balance about it."""
    decision, (certifying, solving, balancing) = passed.decision, seconds
    began, sensed, perceived, governed, commanded = decision.stamps
    build, solve = (optimum.build_seconds, optimum.solve_seconds) if optimum else (0.0, 0.0)
    timings = Timings(
        sense=sensed - began,
        perceive=perceived - sensed,
        govern=governed - perceived,
        control=commanded - governed,
        advance=passed.advancing,
        certify=passed.looking + certifying,
        reference_build=build,
        reference_solve=solve,
        reference_balance=solving - build - solve + balancing if optimum else 0.0,  # with reading the optimum
    )
    return TickRecord(
        index=decision.index,
        time=decision.time,
        truth=passed.truth,
        readings=decision.readings,
        hand_world=decision.hand_world,
        half_spaces=decision.half_spaces,
        problem=decision.problem,
        solution=decision.solution,
        operation=marks.operation,
        flow_passivity=marks.flow,
        optimum=optimum,
        passivity=balance,
        velocity=decision.velocity,
        command=decision.command,
        winding_up=marks.winding,
        timings=timings,
    )
