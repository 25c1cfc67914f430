"""Which passivity balances a governor has, and how they are taken: those of the distributed one, or a plug-in's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates
from pbrg_mj.governor.distributed.governor import DistributedGovernor, DistributedMemory
from pbrg_mj.governor.monitor.passivity import Passivity, flow_passivity, passivity
from pbrg_mj.governor.monitor.passivity_blocks import (
    BlockRounds,
    flow_passivities_of_block,
    passivities_about_optima,
    rounds_of_block,
)
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.problem.interface import Governor, Problem
from pbrg_mj.plugin_calls import copied, plug_in_errors, read_only_copy


class PassivityMonitor(Protocol):
    """Evaluates a governor's memories, T at a time; unknown balances are NaN."""

    def about_optima(self, block: TickBlock, memories: Sequence[Any], optima: Sequence[Optimum]) -> list[Passivity]:
        """Return the balances about the optima of T ticks."""
        ...

    def of_velocity(self, block: TickBlock, memories: Sequence[Any]) -> list[Passivity]:
        """Return the balances of the governor's own velocity at T ticks."""
        ...


def passivity_monitor(governor: Governor) -> PassivityMonitor:
    """Return the monitor of a governor."""
    if isinstance(governor, DistributedGovernor):
        return DistributedPassivity(governor)
    return PlugInPassivity(governor)


class DistributedPassivity:
    """Balances over the rounds that would follow."""

    def __init__(self, governor: DistributedGovernor):
        self.governor = governor
        self._last: tuple[TickBlock, BlockRounds] | None = None  # both balances are asked of one block after the other

    def about_optima(
        self, block: TickBlock, memories: Sequence[DistributedMemory], optima: Sequence[Optimum]
    ) -> list[Passivity]:
        """Return at T ticks the balance over the next round; what is on the lines is not in it."""
        governor = self.governor
        if not _compiled_and_in_time(governor):
            return list(map(self._about_optimum, block.problems, memories, optima))
        rounds = self._rounds(block, memories)
        balances = passivities_about_optima(block, optima, governor.flow, rounds, governor.diverged_beyond)
        return _while_bounded(memories, balances)

    def of_velocity(self, block: TickBlock, memories: Sequence[DistributedMemory]) -> list[Passivity]:
        """Return at T ticks the balance of the flow's own velocity over the next two rounds."""
        if not _compiled_and_in_time(self.governor):
            return list(map(self._of_velocity, block.problems, memories))
        balances = flow_passivities_of_block(block, self.governor.flow, self._rounds(block, memories))
        return _while_bounded(memories, balances)

    def _rounds(self, block: TickBlock, memories: Sequence[DistributedMemory]) -> BlockRounds:
        if self._last is None or self._last[0] is not block:
            self._last = block, rounds_of_block(block, self.governor.flow, [one.estimates for one in memories])
        return self._last[1]

    def _about_optimum(self, problem: Problem, memory: DistributedMemory, optimum: Optimum) -> Passivity:
        if optimum.status != "solved" or memory.diverged:
            return Passivity.unknown()
        flow, before, after = self.governor.flow, memory.estimates, self.governor.run(problem, memory, 1)[0]
        if not self.governor.check(after)[0]:
            return Passivity.unknown()
        rates = Estimates(*((new - now) / flow.step for new, now in zip(after, before, strict=True)))
        return passivity(problem, optimum, flow.alpha, before, rates)

    def _of_velocity(self, problem: Problem, memory: DistributedMemory) -> Passivity:
        if memory.diverged:
            return Passivity.unknown()
        first, links, _ = self.governor.run(problem, memory, 1)
        second = self.governor.run(problem, DistributedMemory(first, memory.m, links), 1)[0]
        return flow_passivity(problem, self.governor.flow, (memory.estimates, first, second))


@dataclass(frozen=True)
class PlugInPassivity:
    """Balances that a plug-in's governor computes itself, if it has `passivity` and `flow_passivity`."""

    governor: Any

    def about_optima(self, block: TickBlock, memories: Sequence[Any], optima: Sequence[Optimum]) -> list[Passivity]:
        """Return what its `passivity(problem, memory, optimum)` returns at T ticks. Raises PlugInError."""
        return [self._balance("passivity", *tick) for tick in zip(block.problems, memories, optima, strict=True)]

    def of_velocity(self, block: TickBlock, memories: Sequence[Any]) -> list[Passivity]:
        """Return what its `flow_passivity(problem, memory)` returns at T ticks. Raises PlugInError."""
        return [self._balance("flow_passivity", *tick) for tick in zip(block.problems, memories, strict=True)]

    def _balance(self, method: str, problem: Problem, memory: Any, *optimum: Optimum) -> Passivity:
        governor = self.governor
        if not isinstance(governor, PlugInGovernor) or not hasattr(governor.inner, method):
            return Passivity.unknown()
        given = governor.read_only_problem(problem)
        with plug_in_errors("governor", governor.name, method, governor.limit):
            found = getattr(governor.inner, method)(given, memory, *map(read_only_copy, optimum))
        whose = f"{governor.name}: the governor"
        if not isinstance(found, Passivity):
            raise PlugInError(f"{whose}'s {method} returned {type(found).__name__}, not Passivity")
        return Passivity(*(float(copied(whose, name, value, ())) for name, value in found._asdict().items()))


def _compiled_and_in_time(governor: DistributedGovernor) -> bool:
    """Return whether the compiled rounds without delay and loss, which blocks of ticks take, are the governor's."""
    return governor.channel is None and governor.backend == "compiled"


def _while_bounded(memories: Sequence[DistributedMemory], balances: Sequence[Passivity]) -> list[Passivity]:
    return [Passivity.unknown() if memory.diverged else one for memory, one in zip(memories, balances, strict=True)]
