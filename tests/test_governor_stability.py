"""The predicted admissible step against the step at which the flow really blows up."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.distributed import DistributedGovernor
from pbrg_mj.governor.primal_dual import Flow, run_rounds
from pbrg_mj.governor.stability import abreast, admissible_step
from tests.problems import FORMATION, GRAPHS, START, graph, problem

WALLS = [(4, [1, 1], 3.0), (0, [0, 1], 2.2), (3, [1, 0.2], 2.5)]


def blows_up(network, walls, alpha, step):
    static = problem(walls, 0.3 * (START - FORMATION), [2.0, 3.0], network)
    flow = Flow(alpha, step)
    estimates = DistributedGovernor(flow, 1, "start").init(static).estimates
    z = run_rounds(static, estimates, flow, int(200 / step)).z
    return not np.isfinite(z).all() or np.abs(z).max() > 100


@pytest.mark.parametrize("alpha", [2.0, 7.0, 20.0])
@pytest.mark.parametrize("name", ["ring", "path", "kite"])
def test_the_flow_holds_at_the_predicted_step_and_falls_apart_not_far_beyond(name, alpha):
    network = graph(GRAPHS[name])
    step = admissible_step(network, FORMATION, alpha)
    for walls in ([], WALLS[:1], WALLS):
        assert not blows_up(network, walls, alpha, step)
    assert any(blows_up(network, walls, alpha, 5.0 * step) for walls in (WALLS[:1], WALLS))


def test_robots_abreast_are_counted_on_the_hulls_edges():
    assert abreast(FORMATION) == 3  # robots 1, 5, 4 on the diagonal; so do 2, 3, 4 at the bottom
    assert abreast(np.zeros((1, 2))) == 1
    assert abreast(np.array([[0.0, 0.0], [1.0, 0.0]])) == 2
    assert abreast(np.array([[np.cos(a), np.sin(a)] for a in np.arange(7)])) == 2
    grid = np.array([[x, y] for x in range(4) for y in range(3)], dtype=float)
    assert abreast(grid) == 4
    inside = np.vstack([grid[[0, 2, 9, 11]], [[1.0, 1.0], [2.0, 1.0]]])
    assert abreast(inside) == 2
