"""What a run tells of its ticks besides what the robots do: certificates, wind-up, the centralized optimum.

Nothing here is fed back. So ticks are watched some at a time, after they have passed: see `Simulation.records`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.operation import Operation, operation
from pbrg_mj.governor.optimum import CentralizedSolver, Optimum
from pbrg_mj.governor.passivity import Passivity
from pbrg_mj.governor.problem import Problem
from pbrg_mj.loop.record import TickRecord, Timings
from pbrg_mj.loop.tick import Decision
from pbrg_mj.team.wind_up import WindUp, WindUpRule, wind_up
from pbrg_mj.world.interface import Truth


@dataclass(frozen=True)
class Watch:
    """How ticks are judged."""

    wind_up_rule: WindUpRule
    passivity: Callable[[Problem, Any, Optimum], Passivity]  # of the governor's own estimates, about an optimum
    flow_passivity: Callable[[Problem, Any], Passivity]  # of their own velocity
    reference_solver: CentralizedSolver | None
    reference_every: int  # ticks


class Watched(NamedTuple):
    """What the next tick's judgement needs of this one's."""

    wind_up: WindUp | None = None  # None before the first tick
    operation: Operation | None = None  # likewise


class Passed(NamedTuple):
    """A tick that has passed: the world as it was, what was decided, and how long looking and moving on took [s]."""

    truth: Truth
    decision: Decision
    looking: float
    advancing: float


def judge(watch: Watch, before: Watched, passed: Sequence[Passed]) -> tuple[Watched, list[TickRecord]]:
    """Return the records of ticks in a row, and what the judgement of those after them needs.

    One stage for all ticks before the next one: its code is then in the processor's caches for all but the first.
    """
    certified = []
    for one in passed:
        before, marks = _certify(watch, before, one.decision)
        certified.append(marks)
    optima = [_optimum(watch, one.decision) for one in passed]
    balances = [_balance(watch, one.decision, optimum) for one, (optimum, _) in zip(passed, optima, strict=True)]
    return before, [_record(*facts) for facts in zip(passed, certified, optima, balances, strict=True)]


class _Marks(NamedTuple):
    """Certificates of one tick."""

    winding: np.ndarray
    operation: Operation
    flow: Passivity
    seconds: float


def _certify(watch: Watch, before: Watched, decision: Decision) -> tuple[Watched, _Marks]:
    began, problem = perf_counter(), decision.problem
    followed = wind_up(watch.wind_up_rule, before.wind_up, problem.p, problem.xi, decision.velocity)
    judged = operation(problem, decision.solution, before.operation)
    flow = watch.flow_passivity(problem, decision.memory)
    return Watched(followed, judged), _Marks(followed.winding, judged, flow, perf_counter() - began)


def _optimum(watch: Watch, decision: Decision) -> tuple[Optimum | None, float]:
    """Return the optimum, and how long it took in all [s]."""
    if watch.reference_solver is None or decision.index % watch.reference_every:
        return None, 0.0
    began = perf_counter()
    return watch.reference_solver.solve(decision.problem), perf_counter() - began


def _balance(watch: Watch, decision: Decision, optimum: Optimum | None) -> tuple[Passivity | None, float]:
    """Return the passivity balance about the optimum, and how long it took [s]."""
    if optimum is None:
        return None, 0.0
    began = perf_counter()
    return watch.passivity(decision.problem, decision.memory, optimum), perf_counter() - began


def _record(
    passed: Passed, marks: _Marks, solved: tuple[Optimum | None, float], balance: tuple[Passivity | None, float]
) -> TickRecord:
    decision, (optimum, seconds) = passed.decision, solved
    began, sensed, perceived, governed, commanded = decision.stamps
    build, solve = (optimum.build_seconds, optimum.solve_seconds) if optimum else (0.0, 0.0)
    timings = Timings(
        sense=sensed - began,
        perceive=perceived - sensed,
        govern=governed - perceived,
        control=commanded - governed,
        advance=passed.advancing,
        certify=passed.looking + marks.seconds,
        reference_build=build,
        reference_solve=solve,
        reference_balance=seconds - build - solve + balance[1],  # with reading the optimum
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
        passivity=balance[0],
        velocity=decision.velocity,
        command=decision.command,
        winding_up=marks.winding,
        timings=timings,
    )
