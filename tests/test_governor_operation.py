"""The certificates of operation against their definitions, and against what theory says of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.monitor.diagnostics import diagnose
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.problem.interface import Solution
from pbrg_mj.governor.problem.rows import rho, row_values
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.problems import graph, random_problem


def answer(problem, m, multipliers):
    return Solution(m, multipliers, "ok", 0, np.zeros(5, dtype=np.int64))


def operation(problem, solution, before):
    (found,) = diagnose(TickBlock.of([problem]), solution.m[None], solution.multipliers[None], before)
    return found


def test_at_the_optimum_all_kkt_residuals_vanish_and_elsewhere_they_do_not():
    rng = np.random.default_rng(1)
    solver, solved = ClarabelSolver(), 0
    for _ in range(200):
        problem = random_problem(rng, graph(leaders=(0, 4)))
        optimum = solver.solve(problem)
        if optimum.status != "solved":
            continue
        solved += 1
        at = operation(problem, answer(problem, np.tile(optimum.m, (5, 1)), optimum.multipliers), None)
        assert at.stationarity < 1e-4 * (1 + optimum.multipliers.sum())
        assert at.complementarity < 1e-6
        assert at.worst_row < 1e-7
        off = operation(problem, answer(problem, np.tile(optimum.m + 0.1, (5, 1)), optimum.multipliers), None)
        assert off.stationarity > 0.1
    assert solved > 50


def test_definitions():
    rng = np.random.default_rng(2)
    problem = random_problem(rng, graph(leaders=(0, 4)))
    m, lam = rng.normal(size=(5, 2)), rng.uniform(size=problem.rows.d.shape) * problem.rows.active
    first = operation(problem, answer(problem, m, lam), None)
    applied = (m[0] + m[4]) / 2
    np.testing.assert_allclose(first.applied_m, applied)
    assert first.storage == pytest.approx(rho(applied, problem.p, problem.xi) ** 2 / 2)
    assert first.storage_change == 0.0
    values = row_values(problem.rows, applied, problem.p, problem.xi)
    assert first.worst_row == values.max()
    assert first.consensus_spread == max(np.linalg.norm(a - b) for a in m for b in m)
    assert first.complementarity == pytest.approx(np.abs(lam[problem.rows.active] * values[problem.rows.active]).max())

    def lagrangian(x):
        g = row_values(problem.rows, x, problem.p, problem.xi)[problem.rows.active]
        return 2 * np.sum((problem.reference - x) ** 2) + lam[problem.rows.active] @ g

    eps = 1e-6 * np.eye(2)
    gradient = [(lagrangian(applied + e) - lagrangian(applied - e)) / 2e-6 for e in eps]
    assert first.stationarity == pytest.approx(np.hypot(*gradient), rel=1e-6)

    moved = dataclasses.replace(problem, p=problem.p + 0.1, xi=problem.xi - 0.05)
    second = operation(moved, answer(moved, m + 1.0, lam), first)
    held = rho(applied, moved.p, moved.xi) ** 2 / 2
    assert second.storage_change == pytest.approx(held - first.storage)


def test_ticks_in_a_row_are_judged_as_one_by_one():
    rng = np.random.default_rng(4)
    problems = [random_problem(rng, graph(leaders=(0, 4))) for _ in range(5)]
    problems = [problems[k] if k % 2 else dataclasses.replace(problems[k], rows=problems[k + 1].rows) for k in range(4)]
    answers = [answer(one, rng.normal(size=(5, 2)), rng.uniform(size=one.rows.d.shape)) for one in problems]
    before, one_by_one = None, []
    for problem, solution in zip(problems, answers, strict=True):
        before = operation(problem, solution, before)
        one_by_one.append(before)
    block = TickBlock.of(problems)
    assert len(block.rows[0]) == 2  # twice two in a row share theirs
    m, multipliers = np.array([one.m for one in answers]), np.array([one.multipliers for one in answers])
    for got, want in zip(diagnose(block, m, multipliers, None), one_by_one, strict=True):
        np.testing.assert_array_equal(got.applied_m, want.applied_m)
        assert got[1:] == want[1:]


def test_v_falls_at_every_tick_in_the_ideal_plant_up_to_the_digital_step():
    """dV/dt <= 0 under the m held over a tick; explicit ticks add at most tick^2 / 2 ||dy/dt||^2."""
    scenario = load_scenario("paper/simulation_inadmissible", ["timing.duration=20", "reference.solver=none"]).scenario
    tick, before, grew = scenario.timing.tick, None, 0
    for record in Simulation.build(scenario).records():
        if before is not None:
            rate = np.sum(before.velocity**2) + np.sum((before.problem.network.laplacian @ before.problem.p) ** 2)
            # robots apply their own m; the leader's is the applied one
            assert record.operation.storage_change <= 0.5 * tick**2 * rate + 1e-12
            grew += record.operation.storage_change > 0
        before = record
    assert grew < 100
