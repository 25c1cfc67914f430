"""The distributed reference governor of Nguyen, Hatanaka, Doi, Garone and Fujita (IFAC 2017)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.channel import Channel, LinkStates
from pbrg_mj.governor.distributed.network_rounds import run_network_rounds
from pbrg_mj.governor.distributed.rounds import Estimates, Flow, judged, run_rounds
from pbrg_mj.governor.monitor.passivity import Passivity, flow_passivity, passivity
from pbrg_mj.governor.monitor.passivity_blocks import flow_passivities_of_block, passivities_about_optima
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.problem.interface import Problem, Solution, Status

DOUBLE = 8  # bytes of one number on the wire
HOPS = 2  # bytes of the hop count in a message that can be late or lost


class DistributedMemory(NamedTuple):
    """The robots' estimates, the last references that were finite, and the messages under way."""

    estimates: Estimates
    m: np.ndarray  # (n, 2)
    exchange: LinkStates | None = None  # None when every message arrives within its round
    diverged: bool = False  # the estimates have left all bounds


@dataclass(frozen=True)
class DistributedGovernor:
    """Passivity-based distributed governor; `rounds * flow.step = tick` runs the paper's flow in real time."""

    flow: Flow
    rounds: int  # per tick
    initial: Literal["zero", "start"]
    channel: Channel | None = None  # None: every message arrives within its round
    diverged_beyond: float = math.inf  # [m]

    def init(self, problem: Problem) -> DistributedMemory:
        """Return first estimates: all zero (paper, simulations), or from the start positions (experiments).

        From the start: m_i = p_i(0), z_p = p(0), z_xi = 0; the overhead camera explains everyone p(0) once.
        """
        n = problem.network.robots
        z = np.zeros((n, 4 * n + 2))
        if self.initial == "start":
            z[:, :2] = problem.p
            z[:, 2 : 2 + 2 * n] = problem.p.reshape(-1)
        estimates = Estimates(z, np.zeros_like(z), np.zeros_like(problem.rows.d), np.zeros((n, 4)))
        exchange = None if self.channel is None else LinkStates.empty(self.channel, n)
        return DistributedMemory(estimates, z[:, :2].copy(), exchange, diverged=not self._check_limits(estimates)[0])

    def step(self, problem: Problem, memory: DistributedMemory) -> tuple[Solution, DistributedMemory]:
        """Run one tick's rounds.

        A flow that has left all bounds is `diverged` for good; the last m_i within them are held. A robot that counts a
        neighbour as lost, or hears of one that does, is `holding` its estimates. A multiplier at its cap says that its
        robot, by all it knows, finds no admissible reference: `infeasible`; the m_i then seek the least violation.
        """
        rounds = 0 if memory.diverged else self.rounds
        estimates, exchange, sent = self._run(problem, memory, rounds)
        status = self._status(estimates, exchange)
        m = memory.m if status == "diverged" else estimates.z[:, :2].copy()
        solution = Solution(
            m=m,
            multipliers=estimates.lam,
            status=status,
            rounds=rounds,
            bytes_sent=sent,
            lost=self._lost(problem, exchange),
        )
        return solution, DistributedMemory(estimates, m, exchange, diverged=status == "diverged")

    def passivities(
        self, block: TickBlock, memories: Sequence[DistributedMemory], optima: Sequence[Optimum]
    ) -> list[Passivity]:
        """Return at T ticks the balance over the round that would follow; what is on the lines is not in it."""
        if self.channel is not None:
            return list(map(self._passivity, block.problems, memories, optima))
        estimates = [memory.estimates for memory in memories]
        found = passivities_about_optima(block, optima, self.flow, estimates, self.diverged_beyond)
        return _while_bounded(memories, found)

    def flow_passivities(self, block: TickBlock, memories: Sequence[DistributedMemory]) -> list[Passivity]:
        """Return at T ticks the balance of the flow's own velocity over the two rounds that would follow."""
        if self.channel is not None:
            return list(map(self._flow_passivity, block.problems, memories))
        found = flow_passivities_of_block(block, self.flow, [memory.estimates for memory in memories])
        return _while_bounded(memories, found)

    def _passivity(self, problem: Problem, memory: DistributedMemory, optimum: Optimum) -> Passivity:
        if optimum.status != "solved" or memory.diverged:
            return Passivity.unknown()
        before, after = memory.estimates, self._run(problem, memory, 1)[0]
        if not self._check_limits(after)[0]:
            return Passivity.unknown()
        rates = {name: (getattr(after, name) - now) / self.flow.step for name, now in vars(before).items()}
        return passivity(problem, optimum, self.flow.alpha, before, Estimates(**rates))

    def _flow_passivity(self, problem: Problem, memory: DistributedMemory) -> Passivity:
        if memory.diverged:
            return Passivity.unknown()
        first, exchange, _ = self._run(problem, memory, 1)
        second = self._run(problem, DistributedMemory(first, memory.m, exchange), 1)[0]
        return flow_passivity(problem, self.flow, (memory.estimates, first, second))

    def _run(
        self, problem: Problem, memory: DistributedMemory, rounds: int
    ) -> tuple[Estimates, LinkStates | None, np.ndarray]:
        """Return the estimates and links after some rounds, and the bytes sent by each robot, (n,)."""
        numbers = 2 * (4 * problem.network.robots + 2)  # (z_i, zeta_i) or a wave, to every neighbour, every round
        if self.channel is None or memory.exchange is None:
            sent = rounds * numbers * DOUBLE * problem.network.degree
            return run_rounds(problem, memory.estimates, self.flow, rounds), None, sent
        links = (memory.estimates, memory.exchange)
        estimates, exchange, messages = run_network_rounds(problem, links, self.channel, self.flow, rounds)
        return estimates, exchange, messages * (numbers * DOUBLE + HOPS)

    def _status(self, estimates: Estimates, exchange: LinkStates | None) -> Status:
        bounded, capped = self._check_limits(estimates)
        if not bounded:
            return "diverged"
        if exchange is not None and exchange.holding.any():
            return "holding"
        return "infeasible" if capped else "ok"

    def _lost(self, problem: Problem, exchange: LinkStates | None) -> np.ndarray:
        """Return how many neighbours each robot counts as lost, (n,)."""
        n = problem.network.robots
        if self.channel is None or exchange is None:
            return np.zeros(n, dtype=np.int64)
        receiver = np.repeat(np.arange(n), problem.network.degree)
        return np.bincount(receiver[exchange.lost_links(self.channel)], minlength=n)

    def _check_limits(self, estimates: Estimates) -> tuple[bool, bool]:
        """Return whether the estimates are within bounds, and whether some multiplier is at its cap."""
        return judged(estimates.z, estimates.lam, self.diverged_beyond, self.flow.multiplier_cap)


def _while_bounded(memories: Sequence[DistributedMemory], found: Sequence[Passivity]) -> list[Passivity]:
    return [Passivity.unknown() if memory.diverged else one for memory, one in zip(memories, found, strict=True)]
