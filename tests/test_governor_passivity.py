"""The equilibrium in closed form, and the passivity balance of the paper's proof as it really is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.certificate import ball_rows, rho
from pbrg_mj.governor.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.distributed import DistributedGovernor
from pbrg_mj.governor.optimum import Optimum
from pbrg_mj.governor.passivity import equilibrium, passivity
from pbrg_mj.governor.primal_dual import Estimates, Flow, run_rounds
from tests.problems import FORMATION, GRAPHS, graph, half_spaces, problem, random_problem

FIELDS = [field.name for field in dataclasses.fields(Estimates)]
STEP = 1e-3


def planted(rng, network):
    """A problem and its optimum, drawn the other way round: m*, lambda* and the state first, then r and h."""
    m, p, xi = rng.normal(size=2), rng.normal(size=(5, 2)), 0.3 * rng.normal(size=(5, 2))
    spaces = half_spaces([(int(rng.integers(5)), rng.normal(size=2), 0.0) for _ in range(3)])
    lam = np.zeros((5, 15))
    for i, k in np.argwhere(spaces.active):
        support = FORMATION @ spaces.G[i, k]
        binding = rng.random() < 0.5
        lam[i, 5 * k + int(np.argmax(support))] = rng.uniform(0.1, 2.0) if binding else 0.0
        slack = 0.0 if binding else rng.uniform(0.1, 1.0)
        spaces.h[i, k] = rho(m, p, xi) + spaces.G[i, k] @ m + support.max() + slack
    rows = ball_rows(spaces, FORMATION)
    gradient = (5 * m - p.sum(axis=0)) / rho(m, p, xi) * lam.sum() + np.einsum("ir,irc->c", lam, rows.C)
    leaders = network.leader.sum()
    static = dataclasses.replace(problem([], p, m + gradient / (2 * leaders), network, xi), rows=rows)
    return static, Optimum(m, "solved", 0.0, lam, "planted", 0.0, 0.0)


def change(static, estimates, flow):
    after = run_rounds(static, estimates, flow, 1)
    return Estimates(*((getattr(after, name) - getattr(estimates, name)) / flow.step for name in FIELDS))


def test_a_thousand_planted_optima_are_fixed_points_of_the_rounds():
    rng = np.random.default_rng(8)
    networks = [graph(edges, leaders) for edges in GRAPHS.values() for leaders in ((4,), (0, 3))]
    for k in range(1000):
        static, optimum = planted(rng, networks[k % len(networks)])
        alpha = rng.uniform(0.5, 8.0)
        still = change(static, equilibrium(static, optimum, alpha, np.zeros(22)), Flow(alpha, STEP))
        for name in ("z", "zeta", "nu"):
            np.testing.assert_allclose(getattr(still, name), 0.0, atol=1e-10)
        np.testing.assert_allclose(still.lam[static.rows.active], 0.0, atol=1e-10)  # g = 0 where lambda > 0


@pytest.mark.parametrize("kind", [ClarabelSolver, CvxpySolver])
def test_the_centralized_solvers_find_the_planted_optima(kind):
    rng = np.random.default_rng(8)
    solver, checked = kind(), 0
    for _ in range(1000):
        static, optimum = planted(rng, graph())
        if np.count_nonzero(optimum.multipliers) < 3:  # three binding rows may leave no interior
            got = solver.solve(static)
            assert got.status == "solved"
            np.testing.assert_allclose(got.m, optimum.m, atol=3e-5)
            checked += 1
    assert checked > 700


@pytest.mark.parametrize("name", GRAPHS)
def test_both_subsystems_are_passive_and_their_balance_is_the_proofs(name):
    """At arbitrary estimates: the primal dissipation equals its closed form, both are never negative."""
    rng = np.random.default_rng(5)
    network, flow = graph(GRAPHS[name]), Flow(2.0, STEP)
    for _ in range(200):
        static, optimum = planted(rng, network)
        lam = rng.uniform(0.2, 1.0, size=(5, 15)) * static.rows.active
        estimates = Estimates(rng.normal(size=(5, 22)), rng.normal(size=(5, 22)), lam, rng.normal(size=(5, 4)))
        balance = passivity(static, optimum, flow.alpha, estimates, change(static, estimates, flow))
        off = estimates.z - equilibrium(static, optimum, flow.alpha, np.zeros(22)).z
        consensus = np.sum(off * (network.laplacian @ off))
        descent = flow.alpha * np.sum(2.0 * network.leader[:, None] * off[:, :2] ** 2)
        assert balance.primal_dissipation == pytest.approx(consensus + descent, rel=1e-7)
        assert balance.dual_dissipation >= -1e-9


def test_the_total_storage_falls_along_a_static_run():
    rng = np.random.default_rng(6)
    static = random_problem(rng)
    optimum = ClarabelSolver().solve(static)
    while optimum.status != "solved":
        static = random_problem(rng)
        optimum = ClarabelSolver().solve(static)
    flow = Flow(2.0, STEP)
    estimates = DistributedGovernor(flow, 1, "zero").init(static).estimates
    totals = []
    for _ in range(200):
        balance = passivity(static, optimum, flow.alpha, estimates, change(static, estimates, flow))
        totals.append(balance.primal_storage + flow.alpha * balance.dual_storage)
        estimates = run_rounds(static, estimates, flow, 100)
    assert np.all(np.diff(totals) <= 1e-4 * totals[0])  # explicit steps add a little: O(step)
    assert totals[-1] < 0.2 * totals[0]


def test_a_wrong_update_shows_in_the_sign():
    """The same estimates with consensus run backwards: dissipation turns negative."""
    rng = np.random.default_rng(9)
    static, optimum = planted(rng, graph())
    flow = Flow(2.0, STEP)
    estimates = Estimates(rng.normal(size=(5, 22)), np.zeros((5, 22)), np.zeros((5, 15)), np.zeros((5, 4)))
    rates = change(static, estimates, flow)
    backwards = dataclasses.replace(rates, z=rates.z + 2 * static.network.laplacian @ estimates.z)
    assert passivity(static, optimum, flow.alpha, estimates, rates).primal_dissipation > 0
    assert passivity(static, optimum, flow.alpha, estimates, backwards).primal_dissipation < 0
