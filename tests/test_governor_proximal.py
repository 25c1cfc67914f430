"""Proximal rounds: what they solve, where they rest, and that they converge up to the bound of docs/theory.md."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.distributed import equations, rounds
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.monitor.equilibrium import equilibrium
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms
from pbrg_mj.governor.stability.proximal_step import proximal_step_bound
from tests.linear_rounds import differentiated_round, longest_step, modes_at, proximal_factors_at, spectral_radius
from tests.problems import FORMATION, RING, graph, problem
from tests.test_governor_equations import close, random_network, random_team
from tests.test_governor_stability import random_feasible


def bound(static, alpha):
    """That of the rows there are."""
    C = np.where(static.rows.active[..., None], static.rows.C, 0.0)
    return proximal_step_bound(static.network, alpha, float(np.linalg.norm(C, 2, axis=(1, 2)).max() ** 2))


def pinned(n, i):
    return np.array([2 + 2 * i, 3 + 2 * i, 2 + 2 * n + 2 * i, 3 + 2 * n + 2 * i])


def random_flow(rng):
    return Flow(rng.uniform(0.5, 5.0), 10.0 ** rng.uniform(-4, 0), rng.choice([0.9, np.inf]), proximal=True)


@pytest.mark.parametrize("seed", range(60))
def test_a_compiled_round_is_the_round_of_the_equations(seed):
    rng = np.random.default_rng(seed)
    static, estimates = random_team(rng, random_network(rng))
    flow = random_flow(rng)
    got = rounds.run_rounds(static, estimates, flow, 1)
    for one, other in zip(got, equations.run_rounds(static, estimates, flow, 1), strict=True):
        close(one, other)


def test_a_step_solves_what_it_says_at_the_kink_and_away_from_it():
    """Both sides of the implicit equations; at the kink the force needs only be a subgradient of rho."""
    rng, kinks, pulls = np.random.default_rng(31), 0, 0
    for _ in range(150):
        static, estimates = random_team(rng, random_network(rng))
        flow, heading = random_flow(rng), rng.normal(size=estimates.z.shape[1])
        local, active = equations.local_problem(static, 0), static.rows.active[0]
        own = equations.Estimate(rng.normal(size=len(heading)), heading, estimates.lam[0, active], np.zeros(4))
        z, lam = equations.proximal_step(local, own, heading, flow)
        gain, rho = flow.step * flow.alpha, equations.radius(z)
        ahead = local.a * rho + local.C @ (2 * z[:2] - own.z[:2]) - local.d
        np.testing.assert_allclose(lam, np.clip(own.lam + flow.step * ahead, 0, flow.multiplier_cap), atol=1e-12)
        force = (heading - z) / gain - equations.cost_gradient(local, z)
        force[:2] -= local.C.T @ own.lam
        pull, scale = float(local.a @ lam), 1e-9 / gain
        if rho > 1e-9:
            np.testing.assert_allclose(force, pull * equations.radius_gradient(z), atol=scale)
            pulls += pull > 0
        else:
            n, kinks = len(z) // 4, kinks + 1
            assert np.linalg.norm(force[2:]) <= pull + scale
            np.testing.assert_allclose(force[:2], -force[2 : 2 + 2 * n].reshape(n, 2).sum(axis=0), atol=scale)
    assert kinks > 5 and pulls > 30


def storage(static, deviation, alpha, step):
    """W of docs/theory.md."""
    z, zeta, lam, nu = deviation
    L, n = static.network.laplacian, static.network.robots
    C = np.where(static.rows.active[..., None], static.rows.C, 0.0)
    coupled = sum(nu[i] @ z[i, pinned(n, i)] + lam[i] @ C[i] @ z[i, :2] for i in range(n))
    squares = np.sum(z**2) + alpha * (np.sum(lam**2) + np.sum(nu**2)) + np.sum((zeta - step * L @ z) ** 2)
    return 0.5 * squares / step - alpha * coupled - 0.5 * np.sum(z * ((L - step * L @ L) @ z))


def largest_growth(static, optimum, alpha, flow, rng, count):
    """The largest relative growth of W in rounds from random estimates."""
    n = static.network.robots
    z, zeta = rng.normal(size=(2, n, 4 * n + 2))
    now = Estimates(z, zeta, rng.random(static.rows.d.shape) * static.rows.active, rng.normal(size=(n, 4)))
    rest = equilibrium(static, optimum, alpha, zeta.mean(axis=0))
    most, last = -np.inf, np.inf
    for _ in range(count):
        deviation = [part - still for part, still in zip(now, rest, strict=True)]
        value = storage(static, deviation, alpha, flow.step)
        most, last = max(most, value - last), value
        assert value > 0.0
        now = rounds.run_rounds(static, now, flow, 1)
    return most / max(last, 1e-6)


def test_the_storage_falls_in_every_round_from_anywhere_where_explicit_rounds_let_it_grow():
    rng, explicit_grew = np.random.default_rng(32), 0
    for _ in range(20):
        static, optimum, _, alpha = random_feasible(rng)
        step = 0.98 * bound(static, alpha)
        assert largest_growth(static, optimum, alpha, Flow(alpha, step, proximal=True), rng, 100) < 1e-4
        explicit_grew += not largest_growth(static, optimum, alpha, Flow(alpha, step), rng, 30) < 1e-4
    assert explicit_grew >= 10


def test_rounds_at_the_bound_decay_at_random_optima_where_explicit_ones_do_not():
    """The rates that docs/theory.md quotes."""
    rng, explicit_unstable = np.random.default_rng(33), 0
    for _ in range(20):
        static, optimum, formation, alpha = random_feasible(rng)
        limit = linear_step_limit(static.network, alpha, max_gradient_norms(static.network, formation, None))
        for step in (0.98 * bound(static, alpha), 0.5 * bound(static, alpha)):
            assert spectral_radius(proximal_factors_at(static, optimum, alpha, step)) <= 1.0 + 1e-9
        explicit_unstable += longest_step(modes_at(static, optimum, alpha)) < 0.98 * limit
    assert explicit_unstable >= 5


def test_the_linearised_round_is_that_of_the_equations():
    """Eigenvalues against those of central differences of the plain round at its rest."""
    rng = np.random.default_rng(34)
    static, optimum, _, alpha = random_feasible(rng)
    while static.network.robots > 2:
        static, optimum, _, alpha = random_feasible(rng)
    flow, n = Flow(alpha, 0.1 * bound(static, alpha), proximal=True), static.network.robots
    rest = equilibrium(static, optimum, alpha, np.zeros(4 * n + 2))
    moved, jacobian = differentiated_round(static, optimum, rest, flow)
    np.testing.assert_allclose(moved, 0.0, atol=1e-4)
    found = np.linalg.eigvals(jacobian)
    for factor in proximal_factors_at(static, optimum, alpha, flow.step):
        assert np.abs(found - factor).min() < 1e-3


def test_a_team_at_rest_on_a_line_stays_where_explicit_rounds_hop_over_the_kink():
    """p = m*, xi = 0 and a row that binds: rho = 0 with lambda > 0."""
    team = problem([(0, [1.0, 0.0], 1.0)], np.tile([0.0, 0.3], (5, 1)), [2.0, 0.3])  # robot 4 stands on the line
    after = {}
    for proximal in (False, True):
        z = np.zeros((5, 22))
        z[:, :12] = np.tile([0.0, 0.3], 6)
        start = Estimates(z, np.zeros((5, 22)), np.zeros(team.rows.d.shape), np.zeros((5, 4)))
        settled = rounds.run_rounds(team, start, Flow(7.0, 5e-3, proximal=proximal), 40_000)
        after[proximal] = np.array([equations.radius(z) for z in settled.z]).max()
    assert after[True] < 1e-9
    assert after[False] > 1e-3


def test_the_bound_is_of_graph_and_rows():
    ring = graph(RING)
    stiffest = np.linalg.eigvalsh(ring.laplacian)[-1]
    assert proximal_step_bound(ring, 1e-3, 1.0) == pytest.approx(2 / (3 * stiffest))
    assert proximal_step_bound(ring, 7.0, 75.0) == pytest.approx(np.sqrt(0.75 / (7 * 75)))
    assert proximal_step_bound(graph([], (0,), 1), 3.0, 0.0) == pytest.approx(0.5)
    assert proximal_step_bound(ring, 7.0, 75.0) > 4 * linear_step_limit(
        ring, 7.0, max_gradient_norms(ring, FORMATION, None)
    )
