"""The centralized reference in its small form, given to Clarabel directly and updated from solve to solve.

All rows share rho, and rho^2 = n ||m - mean p||^2 + s^2 with s^2 = sum ||p_j - mean p||^2 + ||xi||^2. So the problem of
eqs. 10-13 has the variables (m, t), one cone ||(sqrt(n) (m - mean p), s)|| <= t, and one linear row a t + C m <= d for
each group of rows that differ in d alone, the one with the smallest d. Rows with directions have a cone each
(`directional_form`) and the variables m.
"""

# Clarabel ships no type stubs for its compiled module.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math

import clarabel
import numpy as np
from scipy.sparse import csc_matrix

from pbrg_mj.governor.centralized.directional_form import cone_bounds, cone_matrix, cone_pattern
from pbrg_mj.governor.centralized.optimum import Optimum, OptimumStatus
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import clock, kernel

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

_STATUS: dict[str, OptimumStatus] = {
    "Solved": "solved",
    "AlmostSolved": "solved",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible",
}


class ClarabelSolver:
    """One solver object per number of grouped rows and of leaders, its data updated in place.

    A solver belongs to one run, so that nothing Clarabel keeps between solves can leak into another run's bits. Rows
    are grouped, and q and A handed over, when they are others than at the solve before.
    """

    def __init__(self) -> None:
        self._solvers: dict[tuple[int, float, bool], clarabel.DefaultSolver] = {}
        self._rows: Rows | None = None
        self._tightest = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
        self._places = np.empty(0, dtype=np.int64)  # of these rows among all rows of all robots
        self._directional = False  # whether they have directions
        self._held: tuple[tuple[int, float, bool], tuple[float, float, float]] | None = None  # which solver, and its q

    def solve(self, problem: Problem) -> Optimum:
        """Solve `problem`; infeasible and failed are statuses, not exceptions."""
        started = clock()
        solver = self._built(problem)
        built = clock()
        solution = solver.solve()
        solving = clock() - built
        words = str(solution.status)
        found = _STATUS.get(words, "failed")
        shape = problem.rows_shape
        if found != "solved":
            nothing = np.full(shape, np.nan)
            return Optimum(np.full(2, np.nan), found, np.nan, nothing, words, built - started, solving)
        (x, y), count = solution.x[:2], len(self._places)
        cost = problem.cost((x, y))
        multipliers = np.zeros(shape)
        every = 3 if self._directional else 1
        multipliers.reshape(-1)[self._places] = solution.z[: every * count : every]
        return Optimum(np.array([x, y]), found, cost, multipliers, words, built - started, solving)

    def _built(self, problem: Problem) -> clarabel.DefaultSolver:
        """Return the solver with the problem's data in it."""
        rows, (r_x, r_y) = problem.rows, problem.mean_reference
        same_rows = rows is self._rows
        if not same_rows:
            self._rows, self._tightest = rows, tightest_rows(rows)
            self._places = np.ravel_multi_index(self._tightest, rows.d.shape)
            self._directional = len(rows.along) > 0
        leaders, directional = problem.network.leaders, self._directional
        b = cone_bounds(problem, self._tightest) if directional else small_bounds(problem, self._tightest)
        q = (-2.0 * leaders * r_x, -2.0 * leaders * r_y, 0.0)
        key = (len(self._tightest[0]), leaders, directional)
        solver = self._solvers.get(key)
        if solver is not None and same_rows and self._held == (key, q):
            solver.update(b=b)
            return solver
        A = cone_matrix(problem, self._tightest) if directional else small_matrix(problem, self._tightest)
        pull = np.array(q[:2]) if directional else np.array(q)
        if solver is None:
            solver = self._solvers[key] = _solver(leaders, pull, A, b)
        else:
            solver.update(q=pull, A=A, b=b)
        self._held = key, q
        return solver


def _solver(leaders: float, q: np.ndarray, values: np.ndarray, b: np.ndarray) -> clarabel.DefaultSolver:
    """Return a new solver; of the form with a cone for each row where q is of m alone."""
    size = len(q)
    P = csc_matrix((np.full(2, 2.0 * leaders), ([0, 1], [0, 1])), shape=(size, size))
    if size == 2:
        pattern, cones = cone_pattern(len(b) // 3), [clarabel.SecondOrderConeT(3)] * (len(b) // 3)
    else:
        count = len(b) - 4
        pattern, cones = _pattern(count), [clarabel.NonnegativeConeT(count), clarabel.SecondOrderConeT(4)]
    A = csc_matrix((values, *pattern), shape=(len(b), size))
    return clarabel.DefaultSolver(P, q, A, b, cones, _settings())


def tightest_rows(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return robot and row of the row with the smallest d in each group."""
    return _tightest_rows(rows.a, rows.along if len(rows.along) else rows.C, rows.C, rows.d, rows.active)


def small_matrix(problem: Problem, tightest: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return A's values, column after column.

    The small form is min leaders ||m||^2 + q x over x = (m, t) subject to A x + slack = b, slack in the cones.
    """
    root, C, a = math.sqrt(problem.network.robots), problem.rows.C[tightest], problem.rows.a[tightest]
    return np.concatenate([C[:, 0], [-root], C[:, 1], [-root], a, [-1.0]])


def small_bounds(problem: Problem, tightest: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return b (rows + 4,), which alone is new at every tick."""
    b = np.empty(len(tightest[0]) + 4)
    _write_bounds(*tightest, problem.rows.d, problem.p, problem.xi, b)
    return b


@kernel
def _tightest_rows(a, along, C, d, active):
    """Return robot and row of the active row with the smallest d in each run of active rows equal in a, along and C.

    Arguments are those of `Rows`: a (n, R), along and C (n, R, 2), d (n, R), active (n, R).
    """
    robot, chosen, count = np.empty(a.size, dtype=np.int64), np.empty(a.size, dtype=np.int64), 0
    for i in range(a.shape[0]):
        last = -1  # row that the next active one is compared with
        for row in range(a.shape[1]):
            if not active[i, row]:
                continue
            alike = last >= 0 and a[i, row] == a[i, last]
            alike = alike and along[i, row, 0] == along[i, last, 0] and along[i, row, 1] == along[i, last, 1]
            if alike and C[i, row, 0] == C[i, last, 0] and C[i, row, 1] == C[i, last, 1]:
                if d[i, row] < d[i, chosen[count - 1]]:
                    chosen[count - 1] = row
            else:
                robot[count], chosen[count] = i, row
                count += 1
            last = row
    return robot[:count].copy(), chosen[:count].copy()


@kernel
def _write_bounds(robot, row, d, p, xi, b):
    """Write the right-hand side b (rows + 4,) of the small problem.

    `robot` (rows,) and `row` (rows,) are those of `_tightest_rows`, d (n, R), p, xi (n, 2) [m].
    """
    n, count = len(p), len(robot)
    for k in range(count):
        b[k] = d[robot[k], row[k]]
    root, x, y, square = math.sqrt(n), p[:, 0].mean(), p[:, 1].mean(), 0.0
    for j in range(n):
        square += (p[j, 0] - x) ** 2 + (p[j, 1] - y) ** 2 + xi[j, 0] ** 2 + xi[j, 1] ** 2
    b[count], b[count + 1], b[count + 2], b[count + 3] = 0.0, -root * x, -root * y, math.sqrt(square)


def _pattern(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return row indices and column starts of A: every grouped row is full, the cone has one entry a column."""
    rows = np.arange(count)
    indices = np.concatenate([rows, [count + 1], rows, [count + 2], rows, [count]])
    return indices, np.array([0, count + 1, 2 * count + 2, 3 * count + 3])


def _settings() -> clarabel.DefaultSettings:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False  # it would forbid updates
    # On 2,000 planted optima of five robots, apart by 0.05 to 5 m, refinement makes the answers no better (2e-5 m at
    # worst either way), leaves one unsolved that is solved without it, and takes a quarter of the time.
    settings.iterative_refinement_enable = False
    # Data in metres need no scaling. On those planted optima, and on others a twentieth to a hundred times as large,
    # the answers are as good without, and a run takes 8 iterations a solve, 9 at most, in place of 10 and 15.
    settings.equilibrate_enable = False
    for name, value in TOLERANCES.items():
        setattr(settings, name, value)
    return settings
