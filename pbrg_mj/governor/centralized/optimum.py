"""What a centralized solver finds, knowing everything."""

from __future__ import annotations

from typing import Literal, NamedTuple, Protocol

import numpy as np

from pbrg_mj.governor.problem.interface import Problem

OptimumStatus = Literal["solved", "infeasible", "failed"]


class Optimum(NamedTuple):
    """What the centralized solver found."""

    m: np.ndarray  # (2,) m* [m]; NaN unless solved
    status: OptimumStatus
    cost: float  # sum of the leaders' ||r_i - m*||^2 [m^2]; NaN unless solved
    multipliers: np.ndarray  # (n, R) lambda*, one per row; NaN unless solved
    solver_status: str  # in the solver's own words, or `within_range.OUT_OF_RANGE`
    build_seconds: float  # wall clock
    solve_seconds: float  # wall clock


class CentralizedSolver(Protocol):
    """Anything that solves a whole problem at once."""

    def solve(self, problem: Problem) -> Optimum:
        """Return the optimum, or a status that says why there is none."""
        ...
