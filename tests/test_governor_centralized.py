"""The four-dimensional centralized program against eqs. 10-13 written out in full, and against planted optima."""

from __future__ import annotations

import dataclasses

import cvxpy as cp
import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.problem.ball import ball_rows, input_rows
from pbrg_mj.governor.problem.rows import rho, row_values, stacked
from tests.problems import FORMATION, graph, half_spaces, problem, random_problem

SOLVERS = [ClarabelSolver, CvxpySolver]


def oracle(problem):
    """Eqs. 8-9, one cone per row, as one reads them in the paper."""
    m = cp.Variable(2)
    centre = cp.vstack([cp.reshape(m, (1, 2), order="C")] * problem.network.robots)
    distance = cp.norm(cp.vstack([centre - problem.p, problem.xi]), "fro")
    rows = problem.rows
    constraints = [rows.a[i, r] * distance + rows.C[i, r] @ m - rows.d[i, r] <= 0 for i, r in np.argwhere(rows.active)]
    leaders = problem.network.leader.sum()
    program = cp.Problem(cp.Minimize(leaders * cp.sum_squares(problem.reference - m)), constraints)
    program.solve(solver=cp.CLARABEL)
    return program.status, m.value, program.value


@pytest.mark.parametrize("kind", SOLVERS)
def test_the_small_form_is_the_papers_problem(kind):
    rng = np.random.default_rng(1)
    solver, seen = kind(), set()
    for k in range(60):
        network = graph(leaders=(0, 4)) if k % 3 == 0 else None
        random = random_problem(rng, network)
        status, m, cost = oracle(random)
        got = solver.solve(random)
        seen.add(got.status)
        if status == "optimal":
            assert got.status == "solved"
            np.testing.assert_allclose(got.m, m, atol=2e-4)  # the oracle's own accuracy
            assert got.cost == pytest.approx(cost, rel=1e-6, abs=1e-6)
        else:
            assert (status, got.status) == ("infeasible", "infeasible")
            assert np.isnan(got.m).all()
    assert seen == {"solved", "infeasible"}


@pytest.mark.parametrize(
    ("kind", "scale"), [(ClarabelSolver, 0.05), (ClarabelSolver, 1.0), (ClarabelSolver, 100.0), (CvxpySolver, 1.0)]
)
def test_planted_optima(kind, scale):
    """Draw m*, lambda* and the state, derive r and h that make them optimal; the solver has to find them.

    Whether the team is spread over centimetres or over a hundred metres.
    """
    rng = np.random.default_rng(2)
    solver = kind()
    for _ in range(200):
        m, p, xi = scale * rng.normal(size=2), scale * rng.normal(size=(5, 2)), scale * 0.3 * rng.normal(size=(5, 2))
        walls = [(int(rng.integers(5)), rng.normal(size=2), 0.0) for _ in range(3)]
        spaces = half_spaces(walls)
        rows = ball_rows(spaces, FORMATION)
        lam, slack = np.zeros_like(rows.d), np.zeros(spaces.h.shape)
        for i, k in np.argwhere(spaces.active):
            tightest = k * 5 + int(np.argmax(FORMATION @ spaces.G[i, k]))
            binding = rng.random() < 0.5 and np.count_nonzero(lam) < 2  # three may leave no interior
            lam[i, tightest] = scale * rng.uniform(0.1, 2.0) if binding else 0.0
            slack[i, k] = 0.0 if binding else scale * rng.uniform(0.1, 1.0)
            spaces.h[i, k] = rho(m, p, xi) + spaces.G[i, k] @ m + np.max(FORMATION @ spaces.G[i, k]) + slack[i, k]
        rows = ball_rows(spaces, FORMATION)

        def gradient_of(lam, m=m, p=p, xi=xi, rows=rows):
            return (5 * m - p.sum(axis=0)) / rho(m, p, xi) * lam.sum() + np.einsum("ir,irc->c", lam, rows.C)

        planted = problem([], p, m + gradient_of(lam) / 2.0, xi=xi)  # stationarity: 2 (m - r) + grad g' lambda = 0
        planted = dataclasses.replace(planted, rows=rows)
        got = solver.solve(planted)
        assert got.status == "solved"
        np.testing.assert_allclose(got.m, m, atol=3e-5 * max(scale, 1.0))
        assert np.all(got.multipliers >= -1e-9)
        stationarity = gradient_of(lam) - gradient_of(got.multipliers)
        np.testing.assert_allclose(stationarity, 0.0, atol=1e-4 * max(scale, 1.0))
        slackness = got.multipliers * np.where(rows.active, row_values(rows, got.m, p, xi), 0)
        assert np.abs(slackness).max() < 1e-6 * max(scale**2, 1.0)


@pytest.mark.parametrize("kind", SOLVERS)
def test_without_rows_the_reference_itself_is_optimal(kind):
    got = kind().solve(problem([], np.zeros((5, 2)), [1.25, -0.5]))
    assert got.status == "solved"
    np.testing.assert_allclose(got.m, [1.25, -0.5], atol=1e-9)
    assert got.cost == pytest.approx(0.0, abs=1e-12)


def test_both_solvers_find_the_same_with_inputs_constrained_too():
    rng = np.random.default_rng(4)
    direct, readable, seen = ClarabelSolver(), CvxpySolver(), set()
    inputs = input_rows(graph(), alpha_r=1.0, limit=6.0)
    for _ in range(60):
        random = random_problem(rng)
        random = dataclasses.replace(random, rows=stacked(random.rows, inputs))
        a, b = direct.solve(random), readable.solve(random)
        assert a.status == b.status
        seen.add(a.status)
        if a.status == "solved":
            np.testing.assert_allclose(a.m, b.m, atol=5e-5)
            assert row_values(random.rows, a.m, random.p, random.xi).max() < 1e-7
    assert seen == {"solved", "infeasible"}


def test_a_solver_used_before_answers_as_a_new_one():
    """Whatever changed since the solve before: the state alone, the reference, the rows, the leaders."""
    rng = np.random.default_rng(5)
    used, solved = ClarabelSolver(), 0
    bases = [random_problem(rng, graph(leaders=leaders)) for leaders in ((4,), (0, 3)) for _ in range(3)]
    for _ in range(100):
        base, other = (bases[k] for k in rng.integers(len(bases), size=2))
        changed = {"p": base.p + 0.01 * rng.normal(size=(5, 2))}
        for name in ("reference", "rows", "network"):
            if rng.random() < 0.3:
                changed[name] = getattr(other, name)
        problem = dataclasses.replace(base, **changed)
        got, want = used.solve(problem), ClarabelSolver().solve(problem)
        assert (got.status, got.cost) == (want.status, want.cost) or np.isnan(want.cost)
        np.testing.assert_array_equal(got.m, want.m)
        np.testing.assert_array_equal(got.multipliers, want.multipliers)
        solved += got.status == "solved"
    assert 20 < solved < 100
