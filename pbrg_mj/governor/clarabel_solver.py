"""The centralized reference in its small form, given to Clarabel directly and updated from solve to solve.

All rows share rho, and rho^2 = n ||m - mean p||^2 + s^2 with s^2 = sum ||p_j - mean p||^2 + ||xi||^2. So the problem of
eqs. 10-13 has the variables (m, t), one cone ||(sqrt(n) (m - mean p), s)|| <= t, and one linear row a t + C m <= d for
each group of rows that differ in d alone, the one with the smallest d.
"""

# Clarabel ships no type stubs for its compiled module.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import clarabel
import numpy as np
from scipy.sparse import csc_matrix

from pbrg_mj.governor.certificate import Rows
from pbrg_mj.governor.optimum import Found, Optimum
from pbrg_mj.governor.problem import Problem

TOLERANCES = {
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": 1e-9,
    "tol_feas": 1e-8,
    "reduced_tol_gap_abs": 1e-8,
    "reduced_tol_gap_rel": 1e-8,
    "reduced_tol_feas": 1e-7,
}
"""The tightest at which planted optima of five robots were all found: to 2e-5 m, to 5e-5 m with Clarabel's own 1e-8.

Where Clarabel cannot reach the first three it may still reach the reduced ones, and answers `AlmostSolved`.
"""

_FOUND: dict[str, Found] = {
    "Solved": "solved",
    "AlmostSolved": "solved",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible",
}


class ClarabelSolver:
    """One solver object per number of grouped rows, its data updated in place.

    A solver belongs to one run, so that nothing Clarabel keeps between solves can leak into another run's bits.
    """

    def __init__(self) -> None:
        self._solvers: dict[int, clarabel.DefaultSolver] = {}

    def solve(self, problem: Problem) -> Optimum:
        """Solve `problem`; infeasible and failed are statuses, not exceptions."""
        started = perf_counter()
        form = small_form(problem)
        solver = self._solver(form)
        built = perf_counter()
        solution = solver.solve()
        solving = perf_counter() - built
        words = str(solution.status)
        found = _FOUND.get(words, "failed")
        m, cost, multipliers = np.full(2, np.nan), np.nan, np.full(problem.rows.d.shape, np.nan)
        if found == "solved":
            m = np.array(solution.x[:2])
            cost = form.leaders * float(np.sum((m - problem.reference) ** 2))
            multipliers[:] = 0.0
            multipliers[form.tightest] = solution.z[: len(form.tightest[0])]
        return Optimum(m, found, cost, multipliers, words, built - started, solving)

    def _solver(self, form: SmallForm) -> clarabel.DefaultSolver:
        count = len(form.tightest[0])
        values = np.array([2.0 * form.leaders, 2.0 * form.leaders])
        if count in self._solvers:
            self._solvers[count].update(P=values, q=form.q, A=form.A, b=form.b)
            return self._solvers[count]
        P = csc_matrix((values, ([0, 1], [0, 1])), shape=(3, 3))
        A = csc_matrix((form.A, *_pattern(count)), shape=(count + 4, 3))
        cones = [clarabel.NonnegativeConeT(count), clarabel.SecondOrderConeT(4)]
        self._solvers[count] = clarabel.DefaultSolver(P, form.q, A, form.b, cones, _settings())
        return self._solvers[count]


@dataclass(frozen=True)
class SmallForm:
    """min leaders ||m||^2 + q x over x = (m, t) subject to A x + slack = b, slack in the cones."""

    leaders: float
    q: np.ndarray  # (3,)
    A: np.ndarray  # values, column after column: rows of C and a, then the cone's
    b: np.ndarray  # (rows + 4,)
    tightest: tuple[np.ndarray, np.ndarray]  # robot and row of each grouped row


def small_form(problem: Problem) -> SmallForm:
    """Return the data of the small form; its pattern depends on the number of grouped rows alone."""
    n, leaders = problem.network.robots, float(problem.network.leader.sum())
    centre = problem.p.mean(axis=0)
    s = float(np.sqrt(np.sum((problem.p - centre) ** 2) + np.sum(problem.xi**2)))
    tightest = tightest_rows(problem.rows)
    a, C, d = problem.rows.a[tightest], problem.rows.C[tightest], problem.rows.d[tightest]
    root = np.sqrt(n)
    A = np.concatenate([C[:, 0], [-root], C[:, 1], [-root], a, [-1.0]])
    b = np.concatenate([d, [0.0, -root * centre[0], -root * centre[1], s]])
    q = np.array([*(-2.0 * leaders * problem.reference), 0.0])
    return SmallForm(leaders, q, A, b, tightest)


def tightest_rows(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return robot and row of the active row with the smallest d in each run of active rows equal in a and C."""
    robot, row = np.nonzero(rows.active)
    if len(robot) == 0:
        return robot, row
    key = np.column_stack([robot, rows.a[robot, row], rows.C[robot, row]])
    first = np.concatenate([[True], np.any(key[1:] != key[:-1], axis=1)])
    group = np.cumsum(first) - 1
    order = np.lexsort((rows.d[robot, row], group))
    chosen = order[np.flatnonzero(first)]
    return robot[chosen], row[chosen]


def _pattern(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return row indices and column starts of A: every grouped row is full, the cone has one entry a column."""
    rows = np.arange(count)
    indices = np.concatenate([rows, [count + 1], rows, [count + 2], rows, [count]])
    return indices, np.array([0, count + 1, 2 * count + 2, 3 * count + 3])


def _settings() -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # it would forbid updates
    for name, value in TOLERANCES.items():
        setattr(settings, name, value)
    return settings
