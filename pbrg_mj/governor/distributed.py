"""The distributed reference governor of Nguyen, Hatanaka, Doi, Garone and Fujita (IFAC 2017)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pbrg_mj.governor.primal_dual import Estimates, Flow, run_rounds
from pbrg_mj.governor.problem import Problem, Solution, Status

DOUBLE = 8  # bytes of one number on the wire


@dataclass(frozen=True)
class DistributedMemory:
    """The robots' estimates, and the last references that were finite."""

    estimates: Estimates
    m: np.ndarray  # (n, 2)


@dataclass(frozen=True)
class DistributedGovernor:
    """Passivity-based distributed governor; `rounds * flow.step = tick` runs the paper's flow in real time."""

    flow: Flow
    rounds: int  # per tick
    initial: Literal["zero", "start"]

    def init(self, problem: Problem) -> DistributedMemory:
        """Return first estimates: all zero (paper, simulations), or from the start positions (experiments).

        From the start: m_i = p_i(0), z_p = p(0), z_xi = 0; the overhead camera tells everyone p(0) once.
        """
        n = problem.network.robots
        z = np.zeros((n, 4 * n + 2))
        if self.initial == "start":
            z[:, :2] = problem.p
            z[:, 2 : 2 + 2 * n] = problem.p.reshape(-1)
        lam = np.zeros_like(problem.rows.d)
        return DistributedMemory(Estimates(z, np.zeros_like(z), lam, np.zeros((n, 4))), z[:, :2].copy())

    def step(self, problem: Problem, memory: DistributedMemory) -> tuple[Solution, DistributedMemory]:
        """Run one tick's rounds.

        A flow that is no longer finite is `diverged`; the last finite m_i are held. A multiplier at its cap says that
        its robot, by all it knows, finds no admissible reference: `infeasible`; the m_i then seek the least violation.
        """
        estimates = run_rounds(problem, memory.estimates, self.flow, self.rounds)
        finite = bool(np.isfinite(estimates.z).all() and np.isfinite(estimates.lam).all())
        status: Status = "ok" if finite else "diverged"
        if finite and np.any(estimates.lam >= self.flow.multiplier_cap):
            status = "infeasible"
        m = estimates.z[:, :2].copy() if finite else memory.m
        numbers = 2 * (4 * problem.network.robots + 2)  # (z_i, zeta_i), to every neighbour, every round
        solution = Solution(
            m=m,
            multipliers=estimates.lam,
            status=status,
            rounds=self.rounds,
            bytes_sent=self.rounds * numbers * DOUBLE * problem.network.degree,
        )
        return solution, DistributedMemory(estimates, m)
