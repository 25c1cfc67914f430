"""The distributed reference governor of Nguyen, Hatanaka, Doi, Garone and Fujita (IFAC 2017)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pbrg_mj.governor.distributed import equations, network_equations, network_rounds
from pbrg_mj.governor.distributed import rounds as compiled
from pbrg_mj.governor.distributed.compiled_tick import EstimateChecks, run_tick
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.infeasibility import some_row_is_infeasible
from pbrg_mj.governor.distributed.link_states import LinkStates
from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.team.channel import Channel

DOUBLE = 8  # bytes of one number on the wire


class DistributedMemory(NamedTuple):
    """The robots' estimates, the last references that were finite, and the messages under way."""

    estimates: Estimates
    m: np.ndarray  # (n, 2)
    links: LinkStates | None = None  # None when every message arrives within its round
    diverged: bool = False  # the estimates have left all bounds


@dataclass(frozen=True)
class DistributedGovernor:
    """Passivity-based distributed governor; `rounds * flow.step = tick` runs the paper's flow in real time."""

    flow: Flow
    rounds: int  # per tick
    initial: Literal["zero", "start"]
    channel: Channel | None = None  # None: every message arrives within its round
    diverged_beyond: float = math.inf  # [m]
    backend: Literal["compiled", "numpy"] = "compiled"  # fast, or the readable equations

    def init(self, problem: Problem) -> DistributedMemory:
        """Return first estimates: all zero (paper, simulations), or from the start positions (experiments).

        From the start: m_i = p_i(0), z_p = p(0), z_xi = 0; the overhead camera gives every robot p(0) once.
        """
        n = problem.network.robots
        z = np.zeros((n, 4 * n + 2))
        if self.initial == "start":
            z[:, :2] = problem.p
            z[:, 2 : 2 + 2 * n] = problem.p.reshape(-1)
        estimates = Estimates(z, np.zeros_like(z), np.zeros_like(problem.rows.d), np.zeros((n, 4)))
        links = None if self.channel is None else LinkStates.empty(self.channel, n)
        return DistributedMemory(estimates, z[:, :2].copy(), links, diverged=not self.check(estimates)[0])

    def step(self, problem: Problem, memory: DistributedMemory) -> tuple[Solution, DistributedMemory]:
        """Run one tick's rounds.

        A flow that has left all bounds is `diverged` for good; the last m_i within them are held. A robot that counts a
        neighbour as lost, or hears of one that does, is `holding` its estimates. A robot whose own row
        no m meets, by the states it believes in, has `suspected` that nothing is admissible; it cannot know. `capped`
        is a multiplier at its cap. In both cases the m_i seek the least violation.
        """
        rounds = 0 if memory.diverged else self.rounds
        estimates, links, sent, found = self._tick(problem, memory, rounds)
        status = _status(found, links)
        m = memory.m if status == "diverged" else estimates.z[:, :2].copy()
        solution = Solution(
            m=m,
            multipliers=estimates.lam,
            status=status,
            rounds=rounds,
            bytes_sent=sent,
            lost=self._lost(problem, links),
        )
        return solution, DistributedMemory(estimates, m, links, diverged=status == "diverged")

    def _tick(
        self, problem: Problem, memory: DistributedMemory, rounds: int
    ) -> tuple[Estimates, LinkStates | None, np.ndarray, EstimateChecks]:
        """Return what `run` does, and what the estimates say of themselves."""
        if self.backend == "compiled" and (self.channel is None or memory.links is None):
            estimates, found = run_tick(problem, memory.estimates, self.flow, rounds, self.diverged_beyond)
            return estimates, None, _all_sent(problem, rounds), found
        estimates, links, sent = self.run(problem, memory, rounds)
        suspected = some_row_is_infeasible(estimates.z, *problem.rows)
        return estimates, links, sent, EstimateChecks(*self.check(estimates), suspected)

    def run(
        self, problem: Problem, memory: DistributedMemory, rounds: int
    ) -> tuple[Estimates, LinkStates | None, np.ndarray]:
        """Return the estimates and links after some rounds, and the bytes sent by each robot, (n,)."""
        in_numpy = self.backend == "numpy"
        if self.channel is None or memory.links is None:
            run = equations.run_rounds if in_numpy else compiled.run_rounds
            return run(problem, memory.estimates, self.flow, rounds), None, _all_sent(problem, rounds)
        run_late = network_equations.run_network_rounds if in_numpy else network_rounds.run_network_rounds
        before = memory.estimates, memory.links
        estimates, links, messages = run_late(problem, before, self.channel, self.flow, rounds)
        return estimates, links, messages * (_message_bytes(problem) + self.channel.header)

    def _lost(self, problem: Problem, links: LinkStates | None) -> np.ndarray:
        """Return how many neighbours each robot counts as lost, (n,)."""
        network = problem.network
        if self.channel is None or links is None:
            return network.times_degree(0)
        return np.bincount(network.receiver[links.lost_links(self.channel)], minlength=network.robots)

    def check(self, estimates: Estimates) -> tuple[bool, bool]:
        """Return whether the estimates are within bounds, and whether some multiplier is at its cap."""
        return compiled.check_limits(estimates.z, estimates.lam, self.diverged_beyond, self.flow.multiplier_cap)


def _message_bytes(problem: Problem) -> int:
    """Return the bytes of (z_i, zeta_i), or of a wave, to one neighbour in one round."""
    return 2 * (4 * problem.network.robots + 2) * DOUBLE


def _all_sent(problem: Problem, rounds: int) -> np.ndarray:
    """Return the bytes sent by each robot, (n,), where every message is sent."""
    return problem.network.times_degree(rounds * _message_bytes(problem))


def _status(found: EstimateChecks, links: LinkStates | None) -> Status:
    if not found.bounded:
        return "diverged"
    if links is not None and links.holding.any():
        return "holding"
    if found.suspected:
        return "suspected"
    return "capped" if found.capped else "ok"
