"""The centralized reference where some reference near the team is admissible.

Rows that noise has turned may nearly contradict each other. They meet kilometres away, and there the problem's optimum
is: a point to which no governor leads a team, and no yardstick for one. Let c be the mean of p, R the
`reference_range`, r_bar the mean of the leaders' r_i; the cost is their number times ||m - r_bar||^2, and a constant.

*If ||m* - c|| > R + 2 ||r_bar - c||, no reference within R of c is admissible.* Proof: for an admissible m within R of
c, ||m* - r_bar|| <= ||m - r_bar|| <= R + ||r_bar - c||, since m* is optimal, and so ||m* - c|| <= R + 2 ||r_bar - c||.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.centralized.optimum import CentralizedSolver, Optimum
from pbrg_mj.governor.problem.interface import Problem

OUT_OF_RANGE = "OutOfRange"


@dataclass(frozen=True)
class WithinRange:
    """A solver whose problem is infeasible, too, where its optimum proves that nothing near the team is admissible."""

    inner: CentralizedSolver

    def solve(self, problem: Problem) -> Optimum:
        """Return the optimum, `infeasible` with the solver status `OutOfRange` where the theorem says so."""
        found = self.inner.solve(problem)
        if found.status != "solved" or not _is_far(problem, found.m):
            return found
        nothing = np.full(problem.rows_shape, np.nan)
        return found._replace(
            m=np.full(2, np.nan), status="infeasible", cost=np.nan, multipliers=nothing, solver_status=OUT_OF_RANGE
        )


def _is_far(problem: Problem, m: np.ndarray) -> bool:
    (m_x, m_y), (r_x, r_y) = m.tolist(), problem.mean_reference
    if math.hypot(m_x - r_x, m_y - r_y) <= problem.reference_range:
        return False  # wherever c is, by the triangle inequality, and most optima are so near
    x, y = problem.p.mean(axis=0).tolist()
    limit = problem.reference_range + 2.0 * math.hypot(r_x - x, r_y - y)
    return math.hypot(m_x - x, m_y - y) > limit
