"""The centralized solve against plain cvxpy.solve and SLSQP; the round against numpy and SciPy's solve_ivp."""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy as cp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver, tightest_rows
from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.distributed.estimates import Estimates
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.governor.problem.interface import Problem
from performance.rounds import FLOW, ring_problem
from performance.timing import each_in_turn

HALF_SPACES = 5
ROUNDS = 100  # of the flow, for the peers of the round


@dataclass(frozen=True)
class Peers:
    """Times of one call [s] of the same work, and how far the answers are apart."""

    ours: float
    peers: dict[str, float]
    apart: dict[str, float]


def binding_problem() -> Problem:
    """Return five robots and five half-spaces, of which some hold the reference back."""
    problem, _ = ring_problem(5, HALF_SPACES)
    rows = problem.rows
    near = type(rows)(rows.a, rows.C, rows.d * 0.6, rows.active)
    return Problem(problem.network, 0.3 * problem.p, 0.3 * problem.xi, near, np.array([8.0, 6.0]))


def solvers() -> tuple[Peers, float]:
    """Return the centralized solve beside its peers, and the part of it that is Clarabel's own call [s]."""
    problem = binding_problem()
    ours, oracle = ClarabelSolver(), CvxpySolver()
    works = {
        "cvxpy_parametrised": lambda: oracle.solve(problem).m,
        "cvxpy_solve": lambda: _cvxpy_from_scratch(problem),
        "slsqp": lambda: _slsqp(problem),
    }
    answer = ours.solve(problem).m
    apart = {name: float(np.abs(work() - answer).max()) for name, work in works.items()}
    own, *others = each_in_turn((lambda: ours.solve(problem), *works.values()), calls=20)
    again = [ours.solve(problem).solve_seconds for _ in range(200)]
    return Peers(own, dict(zip(works, others, strict=True)), apart), float(np.median(again))


def _cvxpy_from_scratch(problem: Problem) -> np.ndarray:
    """Solve the small form as one would write it down, built anew at each call."""
    robot, row = tightest_rows(problem.rows)
    rows, centre, n = problem.rows, problem.p.mean(axis=0), problem.network.robots
    spread = np.sqrt(np.sum((problem.p - centre) ** 2) + np.sum(problem.xi**2))
    m, t = cp.Variable(2), cp.Variable()
    cone = cp.norm(cp.hstack([np.sqrt(n) * (m - centre), spread])) <= t
    facets = rows.a[robot, row] * t + rows.C[robot, row] @ m <= rows.d[robot, row]
    cp.Problem(cp.Minimize(cp.sum_squares(m - problem.reference)), [cone, facets]).solve(solver=cp.CLARABEL)
    return np.asarray(m.value)


def _slsqp(problem: Problem) -> np.ndarray:
    robot, row = tightest_rows(problem.rows)
    rows, r = problem.rows, problem.reference

    def slack(m: np.ndarray) -> np.ndarray:
        rho = np.sqrt(np.sum((m - problem.p) ** 2) + np.sum(problem.xi**2))
        return rows.d[robot, row] - rows.a[robot, row] * rho - rows.C[robot, row] @ m

    start = problem.p.mean(axis=0)
    found = minimize(lambda m: np.sum((m - r) ** 2), start, method="SLSQP", constraints={"type": "ineq", "fun": slack})
    return found.x


def round_peers() -> Peers:
    """Return 100 rounds of five robots beside numpy and beside solve_ivp over the same time of the same flow."""
    problem, estimates = ring_problem(5)
    span = ROUNDS * FLOW.step

    def integrate() -> np.ndarray:
        start = _packed(estimates)
        return solve_ivp(lambda _t, y: _rates(problem, y), (0.0, span), start, rtol=1e-4, atol=1e-6).y[:, -1]

    def stepwise() -> np.ndarray:
        state = _packed(estimates)
        for _ in range(ROUNDS):
            state = state + FLOW.step * _rates(problem, state)
        return state

    works = {"numpy": stepwise, "solve_ivp": integrate}
    answer = _packed(run_rounds(problem, estimates, FLOW, ROUNDS))
    apart = {name: float(np.abs(work() - answer).max()) for name, work in works.items()}
    own, *others = each_in_turn((lambda: run_rounds(problem, estimates, FLOW, ROUNDS), *works.values()), calls=3)
    return Peers(own, dict(zip(works, others, strict=True)), apart)


def _packed(estimates: Estimates) -> np.ndarray:
    return np.concatenate([estimates.z.ravel(), estimates.zeta.ravel(), estimates.lam.ravel(), estimates.nu.ravel()])


def _rates(problem: Problem, state: np.ndarray) -> np.ndarray:
    """Return eqs. 25-30 as one writes them with numpy: matrices where there are some, a loop over robots else."""
    net, rows, n = problem.network, problem.rows, problem.network.robots
    size, count = 4 * n + 2, rows.d.shape[1]
    parts = np.split(state, np.cumsum([n * size, n * size, n * count]))
    z, zeta, lam, nu = parts[0].reshape(n, size), parts[1].reshape(n, size), parts[2].reshape(n, count), parts[3]
    nu = nu.reshape(n, 4)
    L, alpha, gradient, eta = net.laplacian, FLOW.alpha, np.zeros_like(z), np.zeros_like(lam)
    own = np.empty((n, 4))
    for i in range(n):
        m = z[i, :2]
        ball = np.concatenate([np.tile(m, n) - z[i, 2 : 2 + 2 * n], z[i, 2 + 2 * n :]])
        rho = np.linalg.norm(ball)
        g = np.where(rows.active[i], rows.a[i] * rho + rows.C[i] @ m - rows.d[i], 0.0)
        eta[i] = np.where((lam[i] > 0) | (g > 0), g, 0.0)
        weight = rows.a[i] @ lam[i] / rho if rho > 0 else 0.0
        gradient[i, :2] = 2 * net.leader[i] * (m - problem.reference) + lam[i] @ rows.C[i]
        gradient[i, :2] += weight * ball[: 2 * n].reshape(n, 2).sum(axis=0)
        gradient[i, 2 : 2 + 2 * n], gradient[i, 2 + 2 * n :] = -weight * ball[: 2 * n], weight * ball[2 * n :]
        at = [2 + 2 * i, 3 + 2 * i, 2 + 2 * n + 2 * i, 3 + 2 * n + 2 * i]
        gradient[i, at] += nu[i]
        own[i] = z[i, at] - np.concatenate([problem.p[i], problem.xi[i]])
    dz = -L @ z + L @ zeta - alpha * gradient
    return np.concatenate([dz.ravel(), (-L @ z).ravel(), eta.ravel(), own.ravel()])
