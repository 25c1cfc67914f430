"""What a run reports of its ticks besides what the robots do: certificates, wind-up, the centralized optimum.

Nothing here is fed back. So ticks are evaluated a block at a time, after they have passed: see `Simulation.records`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import CentralizedSolver, Optimum
from pbrg_mj.governor.monitor.diagnostics import Diagnostics, diagnose
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.monitor.tick_block import TickBlock, stack_ticks
from pbrg_mj.governor.problem.block_references import cache_reference_costs
from pbrg_mj.kernel import clock
from pbrg_mj.loop.record import TickRecord, Timings
from pbrg_mj.loop.tick_data import ControlTick
from pbrg_mj.team.wind_up import WindUpDetector, WindUpState, wind_up
from pbrg_mj.world.plant.interface import Truth

MAX_BLOCK_BYTES = 300_000  # bytes of a block's estimates: a hundred ticks of five robots, one of forty


@dataclass(frozen=True)
class Monitor:
    """How ticks are evaluated."""

    wind_up_rule: WindUpDetector
    passivities: Callable[[TickBlock, Sequence[Any], Sequence[Optimum]], list[Passivity]]  # about optima
    flow_passivities: Callable[[TickBlock, Sequence[Any]], list[Passivity]]  # of the governor's own velocity
    reference_solver: CentralizedSolver | None
    reference_every: int  # ticks


class MonitorState(NamedTuple):
    """What the next ticks' evaluation needs of those before."""

    wind_up: WindUpState | None = None  # None before the first tick
    operation: Diagnostics | None = None  # likewise


class CompletedTick(NamedTuple):
    """A tick that has passed: true state, what the robots did, wall-clock seconds of both."""

    truth: Truth
    tick: ControlTick
    truth_seconds: float
    advance_seconds: float


def evaluate(
    monitor: Monitor, before: MonitorState, completed: Sequence[CompletedTick]
) -> tuple[MonitorState, list[TickRecord]]:
    """Return the records of ticks in a row, one or more, and what the evaluation of those after them needs.

    Ticks of a small team are evaluated all at once: a call then costs them little. Of a large one, laying the arrays of
    two ticks side by side takes longer than a call.
    """
    n, records = completed[0].tick.problem.network.robots, []
    ticks = max(1, MAX_BLOCK_BYTES // (3 * 8 * n * (4 * n + 2)))  # z, zeta, and about as many multipliers
    for first in range(0, len(completed), ticks):
        before, evaluated = _evaluate(monitor, before, completed[first : first + ticks])
        records += evaluated
    return before, records


def _evaluate(
    monitor: Monitor, before: MonitorState, completed: Sequence[CompletedTick]
) -> tuple[MonitorState, list[TickRecord]]:
    """Evaluate a block of ticks, one stage for all of them before the next one, while its code is in the caches."""
    began, ticks = clock(), [one.tick for one in completed]
    block = TickBlock.of([one.problem for one in ticks])
    before, certified = _certify(monitor, before, block, ticks)
    certifying = (clock() - began) / len(completed)
    solved = _optima(monitor, ticks)
    began = clock()
    balances = _balances(monitor, block, ticks, [optimum for optimum, _ in solved])
    balancing = (clock() - began) / max(sum(one is not None for one in balances), 1)
    return before, [
        _record(one, certificates, optimum, balance, (certifying, solving, balancing))
        for one, certificates, (optimum, solving), balance in zip(completed, certified, solved, balances, strict=True)
    ]


class _Certificates(NamedTuple):
    """Certificates of one tick."""

    winding: np.ndarray
    operation: Diagnostics
    flow: Passivity


def _certify(
    monitor: Monitor, before: MonitorState, block: TickBlock, ticks: Sequence[ControlTick]
) -> tuple[MonitorState, list[_Certificates]]:
    p, xi, _ = block.state
    velocity = stack_ticks([one.velocity for one in ticks])
    displaced = [one.displacement for one in ticks if one.displacement is not None]
    driven = p + stack_ticks(displaced) if displaced else p  # velocities are those of q
    ways, winding = wind_up(monitor.wind_up_rule, before.wind_up, driven, xi, velocity)
    m = stack_ticks([one.solution.m for one in ticks])
    multipliers = stack_ticks([one.solution.multipliers for one in ticks])
    evaluated = diagnose(block, m, multipliers, before.operation)
    flows = monitor.flow_passivities(block, [one.memory for one in ticks])
    return MonitorState(ways, evaluated[-1]), list(map(_Certificates, winding, evaluated, flows))


def _optima(monitor: Monitor, ticks: Sequence[ControlTick]) -> list[tuple[Optimum | None, float]]:
    """Return of every tick the optimum, and how long it took in all [s]."""
    solver, every = monitor.reference_solver, monitor.reference_every
    due = [tick for tick in ticks if not tick.index % every] if solver else []
    if not (solver and due):
        return [(None, 0.0)] * len(ticks)
    began = clock()
    cache_reference_costs([tick.problem for tick in due])
    each, found = (clock() - began) / len(due), {}
    for tick in due:
        began = clock()
        found[tick.index] = solver.solve(tick.problem), clock() - began + each
    return [found.get(tick.index, (None, 0.0)) for tick in ticks]


def _balances(
    monitor: Monitor, block: TickBlock, ticks: Sequence[ControlTick], optima: Sequence[Optimum | None]
) -> list[Passivity | None]:
    """Return the passivity balances about the optima, None where there is no optimum to balance about."""
    there = [(tick, optimum) for tick, optimum in zip(ticks, optima, strict=True) if optimum is not None]
    if not there:
        return [None] * len(optima)
    if len(there) < len(ticks):
        block = TickBlock.of([tick.problem for tick, _ in there])
    memories, found = [tick.memory for tick, _ in there], [optimum for _, optimum in there]
    balances = iter(monitor.passivities(block, memories, found))
    return [None if optimum is None else next(balances) for optimum in optima]


def _record(
    completed: CompletedTick,
    certificates: _Certificates,
    optimum: Optimum | None,
    balance: Passivity | None,
    seconds: tuple[float, float, float],
) -> TickRecord:
    """Put a record together; `seconds` went into certificates, the optimum and the balance about it."""
    tick, (certifying, solving, balancing) = completed.tick, seconds
    began, sensed, perceived, governed, commanded = tick.timestamps
    build, solve = (optimum.build_seconds, optimum.solve_seconds) if optimum else (0.0, 0.0)
    timings = Timings(  # all in the order of the fields: by name it takes twice as long
        sensed - began,
        perceived - sensed,
        governed - perceived,
        commanded - governed,
        completed.advance_seconds,
        completed.truth_seconds + certifying,
        build,
        solve,
        solving - build - solve + balancing if optimum else 0.0,  # with reading the optimum
    )
    return TickRecord(
        tick.index,
        tick.time,
        completed.truth,
        tick.readings,
        tick.hand_world,
        tick.half_spaces,
        tick.problem,
        tick.solution,
        certificates.operation,
        certificates.flow,
        optimum,
        balance,
        tick.velocity,
        tick.command,
        certificates.winding,
        timings,
    )
