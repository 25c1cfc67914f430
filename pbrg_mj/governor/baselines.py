"""Governors to compare with: none at all, and the centralized optimum applied."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.problem.interface import Problem, Solution, Status


@dataclass(frozen=True)
class NoGovernor:
    """Every robot takes the operator's reference as it comes."""

    def init(self, problem: Problem) -> None:
        """There is nothing to remember."""

    def step(self, problem: Problem, memory: None) -> tuple[Solution, None]:
        """Return m_i = r for all robots."""
        return _everywhere(problem, problem.reference, np.zeros(problem.rows_shape), "ok"), None


@dataclass(frozen=True)
class CentralizedGovernor:
    """The optimum of the whole problem, applied at every tick; while there is none, the last one is held.

    Before the first optimum the mean of the shifted hand points is held: of all references it has the smallest rho.
    """

    solver: CentralizedSolver

    def init(self, problem: Problem) -> np.ndarray:
        """Return the reference held until the first optimum, (2,)."""
        return problem.p.mean(axis=0)

    def step(self, problem: Problem, memory: np.ndarray) -> tuple[Solution, np.ndarray]:
        """Return m_i = m* for all robots, or the held reference with the status that says why."""
        optimum = self.solver.solve(problem)
        if optimum.status == "solved":
            return _everywhere(problem, optimum.m, optimum.multipliers, "ok"), optimum.m
        return _everywhere(problem, memory, np.zeros(problem.rows_shape), optimum.status), memory


def _everywhere(problem: Problem, m: np.ndarray, multipliers: np.ndarray, status: Status) -> Solution:
    n = problem.network.robots
    return Solution(np.tile(m, (n, 1)), multipliers, status, 0, np.zeros(n, dtype=np.int64))
