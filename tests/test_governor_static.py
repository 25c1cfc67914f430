"""Frozen robots: the network finds the centralized optimum (Theorem 3 of the paper)."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from tests.problems import FORMATION, GRAPHS, START, graph, problem

WALLS = {
    1: [(4, [1, 1], 3.0)],
    2: [(4, [1, 1], 3.0), (0, [0, 1], 2.2)],
    3: [(4, [1, 1], 3.0), (0, [0, 1], 2.2), (3, [1, 0.2], 2.5)],
}
P = 0.3 * (START - FORMATION)
XI = np.array([[0.1, -0.2], [0.0, 0.1], [-0.1, 0.1], [0.05, -0.05], [-0.05, 0.05]])


@pytest.mark.parametrize("count", WALLS)
@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("initial", ["zero", "start"])
def test_every_robot_reaches_the_centralized_optimum(name, count, initial):
    static = problem(WALLS[count], P, [2.0, 3.0], graph(GRAPHS[name]), XI)
    optimum = CvxpySolver().solve(static)
    assert optimum.status == "solved"
    assert np.linalg.norm(optimum.m - static.reference) > 0.5  # the walls matter
    governor = DistributedGovernor(Flow(2.0, 5e-3), rounds=500_000, initial=initial)
    solution, _ = governor.step(static, governor.init(static))
    np.testing.assert_allclose(solution.m, np.tile(optimum.m, (5, 1)), atol=1e-4)
    total = solution.multipliers.reshape(-1).sum()
    assert total == pytest.approx(np.nansum(optimum.multipliers), abs=1e-3)


def test_an_admissible_reference_is_applied_unchanged():
    static = problem(WALLS[3], P, [0.2, 0.1], graph(), XI)
    governor = DistributedGovernor(Flow(2.0, 5e-3), rounds=100_000, initial="zero")
    solution, _ = governor.step(static, governor.init(static))
    np.testing.assert_allclose(solution.m, np.tile([0.2, 0.1], (5, 1)), atol=1e-4)
    assert np.all(solution.multipliers == 0.0)


def test_too_large_a_step_is_diverged_and_holds_the_last_finite_reference():
    static = problem(WALLS[1], P, [2.0, 3.0], graph(), XI)
    governor = DistributedGovernor(Flow(2.0, 2.0), rounds=50, initial="start")
    memory = governor.init(static)
    statuses = []
    for _ in range(60):
        solution, memory = governor.step(static, memory)
        statuses.append(solution.status)
        assert np.isfinite(solution.m).all()
    assert statuses[0] in ("ok", "suspected")
    assert statuses[-1] == "diverged"


def test_bytes_count_both_estimates_to_every_neighbour_every_round():
    static = problem(WALLS[1], P, [2.0, 3.0], graph(GRAPHS["kite"]), XI)
    governor = DistributedGovernor(Flow(2.0, 1e-3), rounds=10, initial="zero")
    solution, _ = governor.step(static, governor.init(static))
    np.testing.assert_array_equal(solution.bytes_sent, 10 * 2 * 22 * 8 * np.array([2, 2, 3, 2, 1]))
