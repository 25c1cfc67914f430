"""The centralized reference where what is admissible is far away, against linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.within_range import OUT_OF_RANGE, WithinRange
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor
from pbrg_mj.scenario.load import load_scenario
from tests.problems import graph

RANGE = 5.0


def of_half_planes(normals: np.ndarray, offsets: np.ndarray, p: np.ndarray, reference: np.ndarray) -> Problem:
    """Rows normals (k, 2) . m <= offsets (k,) of the first robot."""
    k = len(offsets)
    C, d, active = np.zeros((5, k, 2)), np.zeros((5, k)), np.zeros((5, k), dtype=bool)
    C[0], d[0], active[0] = normals, offsets, True
    rows = Rows(np.zeros((5, k)), C, d, active)
    return Problem(graph(), p, np.zeros((5, 2)), rows, reference, reference_range=RANGE)


def wedge(angle: float, apex: float) -> tuple[np.ndarray, np.ndarray]:
    """Two half-planes that meet `apex` [m] to the right of the origin and allow what lies between them there."""
    normals = np.array([[-np.sin(angle), np.cos(angle)], [-np.sin(angle), -np.cos(angle)]])
    return normals, normals[:, 0] * apex


def nearest_in_box_norm(normals: np.ndarray, offsets: np.ndarray, centre: np.ndarray) -> float:
    """Return the least max(|x|, |y|) of an admissible m as seen from the centre [m], by a linear program."""
    sides = np.array([[1.0, 0.0, -1.0], [-1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [0.0, -1.0, -1.0]])
    A = np.vstack([np.column_stack([normals, np.zeros(len(offsets))]), sides])
    b = np.concatenate([offsets - normals @ centre, np.zeros(4)])
    found = linprog([0.0, 0.0, 1.0], A_ub=A, b_ub=b, bounds=[(None, None), (None, None), (0.0, None)])
    return np.inf if found.status == 2 else float(found.x[2])


@pytest.mark.parametrize(("apex", "solved"), [(400.0, False), (12.0, False), (4.0, True)])
def test_rows_that_meet_far_away_leave_nothing_near_the_team(apex: float, solved: bool) -> None:
    """With r one metre from the team everything beyond 5 m + 2 m is too far."""
    p = 0.1 * np.random.default_rng(61).normal(size=(5, 2))
    posed = of_half_planes(*wedge(0.002, apex), p - p.mean(axis=0), np.array([0.0, 1.0]))
    bare, found = ClarabelSolver().solve(posed), WithinRange(ClarabelSolver()).solve(posed)
    assert bare.status == "solved"
    assert bare.m[0] == pytest.approx(apex, rel=1e-3)
    assert (found.status == "solved") == solved
    if solved:
        np.testing.assert_array_equal(found.m, bare.m)
    else:
        assert found.status == "infeasible"
        assert found.solver_status == OUT_OF_RANGE
        assert np.isnan(found.m).all() and np.isnan(found.multipliers).all() and np.isnan(found.cost)


def test_what_is_out_of_range_is_so_by_a_linear_program_too() -> None:
    """Of random rows that nearly contradict each other; what is not said to be far keeps every bit."""
    rng, counted = np.random.default_rng(62), {True: 0, False: 0}
    for _ in range(300):
        turned, apex = rng.uniform(0, 2 * np.pi), 10.0 ** rng.uniform(0, 2)
        turn = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
        normals, offsets = wedge(10.0 ** rng.uniform(-3, 0), apex)
        p, reference = rng.normal(size=(5, 2)) + 2.0 * rng.normal(size=2), 10.0 * rng.normal(size=2)
        posed = of_half_planes(normals @ turn.T, offsets, p, reference)
        bare, found = ClarabelSolver().solve(posed), WithinRange(ClarabelSolver()).solve(posed)
        if bare.status != "solved":
            continue
        far = found.solver_status == OUT_OF_RANGE
        counted[far] += 1
        if far:
            assert nearest_in_box_norm(normals @ turn.T, offsets, p.mean(axis=0)) > RANGE / np.sqrt(2)
        else:
            np.testing.assert_array_equal(found.m, bare.m)
    assert min(counted.values()) > 50


def test_the_centralized_governor_holds_where_nothing_near_is_admissible() -> None:
    applied = governor(load_scenario("paper/simulation_near", ["governor.kind=centralized"]).scenario)
    p = np.zeros((5, 2))
    memory = applied.init(of_half_planes(*wedge(0.002, -4.0), p, np.array([0.0, 1.0])))
    for apex, status in ((-4.0, "ok"), (400.0, "infeasible")):
        solution, memory = applied.step(of_half_planes(*wedge(0.002, apex), p, np.array([0.0, 1.0])), memory)
        assert solution.status == status
        assert np.linalg.norm(solution.m, axis=1).max() < 1.0
