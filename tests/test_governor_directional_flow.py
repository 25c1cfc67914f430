"""The paper's flow on the directional ball: its gradients, its fixed points, and the compiled rounds."""

from __future__ import annotations

import dataclasses

import cvxpy as cp
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.distributed import equations, rounds
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.infeasibility import some_row_is_infeasible
from pbrg_mj.governor.monitor.diagnostics import diagnose
from pbrg_mj.governor.monitor.equilibrium import dual_force, equilibrium
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.problem.directional_ball import DirectionalBallCertificate, facet_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows, row_values, stacked
from tests.problems import FORMATION, GRAPHS, START, graph, half_spaces, problem, random_problem

P = 0.3 * (START - FORMATION)
XI = np.array([[0.1, -0.2], [0.0, 0.1], [-0.1, 0.1], [0.05, -0.05], [-0.05, 0.05]])
WALLS = [(4, [1, 1], 3.0), (0, [0, 1], 2.2)]


def directional(static: Problem, walls, inputs: Rows | None = None) -> Problem:
    """The same problem with the directional ball of its walls."""
    rows = DirectionalBallCertificate(FORMATION, inputs, 0.0).rows(half_spaces(walls))
    return dataclasses.replace(static, rows=rows)


def random_directional(rng: np.random.Generator, network=None, inputs: Rows | None = None) -> Problem:
    walls = [(int(rng.integers(5)), rng.normal(size=2), float(rng.uniform(1.0, 6.0))) for _ in range(3)]
    return directional(random_problem(rng, network), walls, inputs)


def random_estimates(rng: np.random.Generator, static: Problem) -> Estimates:
    n, rows = static.network.robots, static.rows
    z, zeta = rng.normal(size=(2, n, 4 * n + 2))
    z[0] = np.concatenate([np.tile(z[0, :2], n + 1), np.zeros(2 * n)])  # at the kink of every norm
    lam = rng.uniform(0, 1, rows.d.shape) * (rng.random(rows.d.shape) < 0.5) * rows.active
    return Estimates(z, zeta, lam, rng.normal(size=(n, 4)))


def lagrangian(static: Problem, i: int, z: np.ndarray, lam: np.ndarray, nu: np.ndarray) -> float:
    """f_i + lambda_i' g_i + nu_i' h_i, written out with the states stacked."""
    n, rows = static.network.robots, static.rows
    m, p, xi = z[:2], z[2 : 2 + 2 * n].reshape(n, 2), z[2 + 2 * n :].reshape(n, 2)
    own = Rows(*(array[i : i + 1] for array in rows))
    g = np.where(own.active, row_values(own, m, p, xi), 0.0)[0]
    h = np.concatenate([p[i] - static.p[i], xi[i] - static.xi[i]])
    return float(static.network.leader[i] * np.sum((static.reference - m) ** 2) + lam @ g + nu @ h)


def test_the_gradient_is_the_lagrangians_by_finite_differences():
    rng, inputs = np.random.default_rng(31), facet_rows(graph(), 1.0, 2.0, 6)
    for _ in range(5):
        static = random_directional(rng, inputs=inputs)
        estimates = random_estimates(rng, static)
        pushed = dual_force(*(estimates.z, estimates.lam, estimates.nu), *(static.rows[k] for k in (0, 1, 4)))
        for i in range(1, 5):
            local, active = equations.local_problem(static, i), static.rows.active[i]
            z, lam, nu = estimates.z[i], estimates.lam[i], estimates.nu[i]
            force = equations.inequality_force(local, z, lam[active]) + equations.equality_force(local, z, nu)
            np.testing.assert_allclose(pushed[i], force, atol=1e-12)
            differences = np.empty(len(z))
            for c in range(len(z)):
                step = np.zeros(len(z))
                step[c] = 1e-6
                ends = (lagrangian(static, i, z + sign * step, lam, nu) for sign in (1, -1))
                differences[c] = next(ends) - next(ends)
            np.testing.assert_allclose(force + equations.cost_gradient(local, z), differences / 2e-6, atol=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_a_compiled_round_is_the_round_of_the_equations(seed: int):
    rng = np.random.default_rng(100 + seed)
    network = graph(list(GRAPHS.values())[seed % 4], leaders=((4,), (0, 3))[seed % 2])
    static = random_directional(rng, network, facet_rows(network, 1.0, 2.0, 3 + seed % 6))
    estimates, flow = random_estimates(rng, static), Flow(rng.uniform(0.5, 5.0), 1e-2, rng.choice([0.9, np.inf]))
    compiled, specified = (module.run_rounds(static, estimates, flow, 3) for module in (rounds, equations))
    for got, want in zip(compiled, specified, strict=True):
        np.testing.assert_allclose(got, want, rtol=0, atol=1e-12)


def test_both_solvers_find_the_optimum_of_the_rows_written_out():
    """One cone of all 4n numbers a row."""
    rng, seen = np.random.default_rng(32), set()
    direct, readable = ClarabelSolver(), CvxpySolver()
    for k in range(16):
        static = random_directional(rng, inputs=facet_rows(graph(), 1.0, 5.0, 8) if k % 2 else None)
        rows, m = static.rows, cp.Variable(2)
        sizes = {
            (i, r): cp.norm(
                cp.hstack([static.p @ rows.along[i, r] - m @ rows.along[i, r], static.xi @ rows.along[i, r]])
            )
            for i, r in np.argwhere(rows.active)
        }
        allowed = [rows.a[one] * size + rows.C[one] @ m <= rows.d[one] for one, size in sizes.items()]
        program = cp.Problem(cp.Minimize(cp.sum_squares(static.reference - m)), allowed)
        program.solve(solver=cp.CLARABEL)
        found = [solver.solve(static) for solver in (direct, readable)]
        seen.add(found[0].status)
        for one in found:
            assert one.status == ("solved" if program.status == "optimal" else "infeasible")
            if one.status == "solved":
                np.testing.assert_allclose(one.m, m.value, atol=2e-4)
                assert row_values(rows, one.m, static.p, static.xi).max() < 1e-6
        if found[0].status == "solved":
            np.testing.assert_allclose(found[0].multipliers.sum(), found[1].multipliers.sum(), atol=1e-3)
    assert seen == {"solved", "infeasible"}


@pytest.mark.parametrize("name", GRAPHS)
def test_frozen_robots_find_the_centralized_optimum_and_stay_there(name: str):
    static = directional(problem([], P, [2.0, 3.0], graph(GRAPHS[name]), XI), WALLS)
    optimum = CvxpySolver().solve(static)
    assert optimum.status == "solved"
    ball = CvxpySolver().solve(problem(WALLS, P, [2.0, 3.0], graph(GRAPHS[name]), XI))
    assert np.linalg.norm(optimum.m - static.reference) < np.linalg.norm(ball.m - static.reference) - 0.1
    governor = DistributedGovernor(Flow(2.0, 5e-3), rounds=200_000, initial="start")
    solution, _ = governor.step(static, governor.init(static))
    np.testing.assert_allclose(solution.m, np.tile(optimum.m, (5, 1)), atol=1e-4)
    assert solution.multipliers.sum() == pytest.approx(optimum.multipliers.sum(), abs=1e-3)
    at_rest = equilibrium(static, optimum, 2.0, np.zeros(22))
    after = rounds.run_rounds(static, at_rest, Flow(2.0, 1e-3), 1)
    for now, then in zip(at_rest, after, strict=True):
        np.testing.assert_allclose(then, now, atol=1e-6)
    [found] = diagnose(TickBlock.of([static]), np.tile(optimum.m, (1, 5, 1)), optimum.multipliers[None], None)
    assert found.stationarity < 1e-4
    assert found.complementarity < 1e-6
    assert found.worst_row == pytest.approx(0.0, abs=1e-6)


def test_a_row_that_no_reference_meets_is_suspected_when_it_is_so():
    """In terms of one half-space, over all m on the line along its normal, on which the row is convex."""
    rng, met = np.random.default_rng(33), set()
    for _ in range(40):
        walls = [(2, rng.normal(size=2), float(rng.uniform(-2.0, 3.0)))]
        static = directional(random_problem(rng), walls)
        z = np.tile(np.concatenate([np.zeros(2), static.p.reshape(-1), static.xi.reshape(-1)]), (5, 1))
        G, mean = half_spaces(walls).G[2, 0], static.p.mean(axis=0)
        least = minimize_scalar(lambda y, s=static, c=mean, G=G: s.row_values(c + y * G).max(), (-1.0, 1.0)).fun
        assert some_row_is_infeasible(z, *static.rows) == (least > 1e-7)
        met.add(least > 0)
    assert met == {True, False}


def test_facets_hold_the_polygon_of_velocities_and_opposite_ones_share_a_row():
    """Of states on a facet's border none has a larger F.u_i, and some have as large a one."""
    network, rng = graph(), np.random.default_rng(35)
    even, odd = facet_rows(network, 1.7, 0.8, 8), facet_rows(network, 1.7, 0.8, 5)
    assert (even.d.shape, odd.d.shape) == ((5, 4), (5, 5))
    L = network.laplacian
    A = np.hstack([-L - 1.7 * np.diag(network.leader), L])
    for rows in (even, odd):
        np.testing.assert_allclose(rows.a, np.linalg.norm(A, axis=1)[:, None] * np.ones(rows.d.shape))
        for i, r in np.argwhere(rows.active):
            x_G = rng.normal(size=10)
            x_G[:] = A[i] if rng.random() < 0.5 else x_G
            x_G *= rows.d[i, r] / rows.a[i, r] / np.linalg.norm(x_G)
            assert abs(A[i] @ x_G) <= rows.d[i, r] + 1e-12
    assert even.d[0, 0] == pytest.approx(0.8 * np.cos(np.pi / 8))
    both = stacked(random_directional(rng).rows, even)
    assert both.along.shape == (*both.d.shape, 2)
