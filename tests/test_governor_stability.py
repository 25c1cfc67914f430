"""Where the linear modes ring against where the flow really blows up, and how often a shorter step already does."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.governor.monitor.equilibrium import equilibrium
from pbrg_mj.governor.problem.ball import input_rows
from pbrg_mj.governor.problem.rows import rho, stacked
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms, max_robots_on_hull_edge
from tests.linear_rounds import differentiated_round, longest_step, modes_at
from tests.problems import FORMATION, GRAPHS, START, graph, problem

WALLS = [(4, [1, 1], 3.0), (0, [0, 1], 2.2), (3, [1, 0.2], 2.5)]


def blows_up(network, walls, alpha, step, inputs=None):
    static = problem(walls, 0.3 * (START - FORMATION), [2.0, 3.0], network)
    if inputs is not None:
        static = dataclasses.replace(static, rows=stacked(static.rows, inputs))
    flow = Flow(alpha, step)
    estimates = DistributedGovernor(flow, 1, "start").init(static).estimates
    z = run_rounds(static, estimates, flow, int(200 / step)).z
    return not np.isfinite(z).all() or np.abs(z).max() > 100


@pytest.mark.parametrize("alpha", [2.0, 7.0, 20.0])
@pytest.mark.parametrize("name", ["ring", "path", "kite"])
def test_the_flow_holds_at_the_predicted_step_and_falls_apart_not_far_beyond(name, alpha):
    network = graph(GRAPHS[name])
    step = linear_step_limit(network, alpha, max_gradient_norms(network, FORMATION, None))
    for walls in ([], WALLS[:1], WALLS):
        assert not blows_up(network, walls, alpha, step)
    assert any(blows_up(network, walls, alpha, 5.0 * step) for walls in (WALLS[:1], WALLS))


@pytest.mark.parametrize("alpha", [2.0, 7.0])
@pytest.mark.parametrize("limit", [2.5, 8.0])  # infeasible, and binding
def test_so_it_does_with_input_rows_and_their_curvature(alpha, limit):
    inputs = input_rows(graph(), 1.0, limit)
    step = linear_step_limit(graph(), alpha, max_gradient_norms(graph(), FORMATION, inputs))
    assert step < 0.5 * linear_step_limit(graph(), alpha, max_gradient_norms(graph(), FORMATION, None))
    for walls in ([], WALLS):
        assert not blows_up(graph(), walls, alpha, step, inputs)
    assert any(blows_up(graph(), walls, alpha, 40.0 * step, inputs) for walls in ([], WALLS))


def random_feasible(rng):
    """A team of 2 to 6 robots near a wall or three, where some row binds; its alpha."""
    while True:
        n = int(rng.integers(2, 7))
        edges = {(int(rng.integers(k)), k) for k in range(1, n)}
        edges |= {(i, k) for i in range(n) for k in range(i + 1, n) if rng.random() < 0.2}
        leaders = rng.permutation(n)[: rng.integers(1, n + 1)]
        walls = [
            (int(rng.integers(n)), rng.normal(size=2), float(rng.uniform(0.5, 4))) for _ in range(rng.integers(1, 4))
        ]
        spread = 10 ** rng.uniform(-2, -0.3)
        p, xi, formation = (
            spread * rng.normal(size=(n, 2)),
            spread * rng.normal(size=(n, 2)),
            rng.uniform(-1, 1, (n, 2)),
        )
        network = graph(sorted(edges), tuple(leaders), n)
        found = problem(walls, p, 4 * rng.normal(size=2), network, xi - xi.mean(axis=0), formation)
        optimum = ClarabelSolver().solve(found)
        if optimum.status == "solved" and optimum.multipliers.max() > 1e-4:
            return found, optimum, formation, 10 ** rng.uniform(-0.3, 1.3)


def test_how_often_a_round_at_the_linear_limit_is_unstable_at_random_optima():
    """The rates that docs/theory.md quotes: the limit is no bound, and curvature is what breaks it."""
    rng, unstable, unstable_where_flat, flat, unstable_when_shrunk = np.random.default_rng(21), 0, 0, 0, 0
    for _ in range(60):
        static, optimum, formation, alpha = random_feasible(rng)
        n = static.network.robots
        limit = linear_step_limit(static.network, alpha, max_gradient_norms(static.network, formation, None))
        stiffness = alpha * n * optimum.multipliers.sum() / rho(optimum.m, static.p, static.xi)
        true = longest_step(modes_at(static, optimum, alpha))
        unstable += true < 0.98 * limit
        flat += limit * stiffness < 1.0
        unstable_where_flat += limit * stiffness < 1.0 and true < 0.98 * limit
        unstable_when_shrunk += true < 0.98 / (1.0 / limit + stiffness)
    assert 15 <= unstable <= 45
    assert flat >= 10 and unstable_where_flat <= 2
    assert unstable_when_shrunk <= 1


def test_the_linearised_round_is_that_of_the_equations():
    """Eigenvalues against those of central differences of the plain round at its rest."""
    rng = np.random.default_rng(22)
    static, optimum, _, alpha = random_feasible(rng)
    while static.network.robots > 2:
        static, optimum, _, alpha = random_feasible(rng)
    flow, rest = Flow(alpha, 1e-3), equilibrium(static, optimum, alpha, np.zeros(10))
    _, jacobian = differentiated_round(static, optimum, rest, flow)
    found = np.linalg.eigvals((jacobian - np.eye(len(jacobian))) / flow.step)
    for mode in modes_at(static, optimum, alpha):
        assert np.abs(found - mode).min() < 1e-3 * max(1.0, abs(mode))


def test_the_steepest_gradient_bounds_that_of_all_rows_together():
    rng = np.random.default_rng(3)
    inputs = input_rows(graph(), 1.0, 2.0)
    for rows_of_inputs in (None, inputs):
        bound = max_gradient_norms(graph(), FORMATION, rows_of_inputs)
        for _ in range(200):
            static = problem([(int(rng.integers(5)), rng.normal(size=2), 1.0)], rng.normal(size=(5, 2)), [0.0, 0.0])
            rows = static.rows if rows_of_inputs is None else stacked(static.rows, inputs)
            m, xi = rng.normal(size=2), rng.normal(size=(5, 2))
            slope = (5 * m - static.p.sum(axis=0)) / rho(m, static.p, xi)
            binding = rows.active.copy()  # of the ball rows those that bind at once: robots of one hull edge
            binding[:, :15] &= rows.d[:, :15] <= np.where(binding, rows.d, np.inf)[:, :15].min() + 1e-9
            gradients = (rows.a[..., None] * slope + rows.C) * binding[..., None]
            assert np.all(np.linalg.norm(gradients, axis=(1, 2)) <= bound + 1e-9)


def test_robots_abreast_are_counted_on_the_hulls_edges():
    assert max_robots_on_hull_edge(FORMATION) == 3  # robots 1, 5, 4 on the diagonal; so do 2, 3, 4 at the bottom
    assert max_robots_on_hull_edge(np.zeros((1, 2))) == 1
    assert max_robots_on_hull_edge(np.array([[0.0, 0.0], [1.0, 0.0]])) == 2
    assert max_robots_on_hull_edge(np.array([[np.cos(a), np.sin(a)] for a in np.arange(7)])) == 2
    grid = np.array([[x, y] for x in range(4) for y in range(3)], dtype=float)
    assert max_robots_on_hull_edge(grid) == 4
    inside = np.vstack([grid[[0, 2, 9, 11]], [[1.0, 1.0], [2.0, 1.0]]])
    assert max_robots_on_hull_edge(inside) == 2
