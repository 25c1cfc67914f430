"""The predicted admissible step against the step at which the flow really blows up."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.governor.problem.ball import input_rows
from pbrg_mj.governor.problem.rows import rho, stacked
from pbrg_mj.governor.stability.step_bound import admissible_step, robots_abreast, steepest_gradients
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
    step = admissible_step(network, alpha, steepest_gradients(network, FORMATION, None))
    for walls in ([], WALLS[:1], WALLS):
        assert not blows_up(network, walls, alpha, step)
    assert any(blows_up(network, walls, alpha, 5.0 * step) for walls in (WALLS[:1], WALLS))


@pytest.mark.parametrize("alpha", [2.0, 7.0])
@pytest.mark.parametrize("limit", [2.5, 8.0])  # infeasible, and binding
def test_so_it_does_with_input_rows_and_their_curvature(alpha, limit):
    inputs = input_rows(graph(), 1.0, limit, 8)
    step = admissible_step(graph(), alpha, steepest_gradients(graph(), FORMATION, inputs))
    assert step < 0.5 * admissible_step(graph(), alpha, steepest_gradients(graph(), FORMATION, None))
    for walls in ([], WALLS):
        assert not blows_up(graph(), walls, alpha, step, inputs)
    assert any(blows_up(graph(), walls, alpha, 40.0 * step, inputs) for walls in ([], WALLS))


def test_the_steepest_gradient_bounds_that_of_all_rows_together():
    rng = np.random.default_rng(3)
    inputs = input_rows(graph(), 1.0, 2.0, 8)
    for rows_of_inputs in (None, inputs):
        bound = steepest_gradients(graph(), FORMATION, rows_of_inputs)
        for _ in range(200):
            static = problem([(int(rng.integers(5)), rng.normal(size=2), 1.0)], rng.normal(size=(5, 2)), [0.0, 0.0])
            rows = static.rows if rows_of_inputs is None else stacked(static.rows, inputs)
            m, xi = rng.normal(size=2), rng.normal(size=(5, 2))
            slope = (5 * m - static.p.sum(axis=0)) / rho(m, static.p, xi)
            binding = rows.active.copy()  # of the ball rows those that bind at once: robots robots_abreast
            binding[:, :15] &= rows.d[:, :15] <= np.where(binding, rows.d, np.inf)[:, :15].min() + 1e-9
            gradients = (rows.a[..., None] * slope + rows.C) * binding[..., None]
            assert np.all(np.linalg.norm(gradients, axis=(1, 2)) <= bound + 1e-9)


def test_robots_abreast_are_counted_on_the_hulls_edges():
    assert robots_abreast(FORMATION) == 3  # robots 1, 5, 4 on the diagonal; so do 2, 3, 4 at the bottom
    assert robots_abreast(np.zeros((1, 2))) == 1
    assert robots_abreast(np.array([[0.0, 0.0], [1.0, 0.0]])) == 2
    assert robots_abreast(np.array([[np.cos(a), np.sin(a)] for a in np.arange(7)])) == 2
    grid = np.array([[x, y] for x in range(4) for y in range(3)], dtype=float)
    assert robots_abreast(grid) == 4
    inside = np.vstack([grid[[0, 2, 9, 11]], [[1.0, 1.0], [2.0, 1.0]]])
    assert robots_abreast(inside) == 2
