"""Several leaders and references up to 1e6 m away: the penalty stays exact, and what crosses is the paper's flow."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.penalty import LEAST_SLACK, exact_multiplier_cap
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from scripts.far_references import least_margin, random_team
from tests.problems import graph, problem

NORMAL, OFFSET = np.array([1.0, 1.0]) / np.sqrt(2.0), 3.0 / np.sqrt(2.0)
RANGE = 5.0  # [m]
ALL_LEAD = ("team.leaders=[1,2,3,4,5]", "operator.reference=[20,30]", "reference.solver=none")


def needed_slack(n, leaders, s):
    """The least e at which no reference needs a larger multiplier than the cap: docs/theory.md, any reference."""
    lag = 1.0 + s * np.sqrt((n - leaders) / (n * leaders)) / RANGE

    def gain(e):
        X = np.sqrt(n * e * (2.0 - e))
        return (n + X) / X

    return next(e for e in np.linspace(LEAST_SLACK, 1.0, 400) if lag * gain(e) <= gain(LEAST_SLACK))


@pytest.mark.parametrize("leaders", [1, 2, 3, 4, 5])
def test_no_reference_to_a_million_metres_needs_more_than_the_cap_whoever_leads(leaders):
    """Random spreads, integral states, slacks and references; the multipliers that the exact solver finds."""
    rng, n, largest = np.random.default_rng(leaders), 5, 0.0
    cap = exact_multiplier_cap(n, leaders, RANGE)
    for case in range(60):
        size = rng.uniform(0.05, 1.0)
        p, xi = size * rng.normal(size=(n, 2)), size * rng.normal(size=(n, 2))
        p, xi = p - p.mean(axis=0), xi - xi.mean(axis=0)
        s = float(np.sqrt((p**2).sum() + (xi**2).sum()))
        e = max(
            needed_slack(n, leaders, s), 1.0 - np.sqrt((n - 1) / n)
        )  # from the second one on m = mean p is admissible
        D = s * np.sqrt((n - 1) / n) / (1.0 - e) * (1.0 if case % 2 else rng.uniform(1.0, 4.0))
        angle, far = (np.pi, rng.uniform(-np.pi, np.pi))[case % 3 > 0], 10.0 ** rng.uniform(0.0, 6.0)
        r = far * np.array([np.cos(angle), np.sin(angle)])
        team = graph(leaders=tuple(rng.permutation(n)[:leaders].tolist()))
        wall = [(n - 1, [1.0, 0.0], D)]
        far_one = problem(wall, p, r, team, xi, np.zeros((n, 2)))
        found = ClarabelSolver().solve(dataclasses.replace(far_one, reference_range=RANGE))
        assert np.isfinite(found.m).all()
        largest = max(largest, found.multipliers.sum() / cap)
    assert 0.5 < largest <= 1.0


def margins_of(kind, *overrides):
    changes = (*ALL_LEAD, f"governor.kind={kind}", "timing.duration=6", *overrides)
    scenario = load_scenario("paper/simulation_inadmissible", changes).scenario
    return [OFFSET - float((tick.hand_world @ NORMAL).max()) for tick in Simulation.build(scenario).control_ticks()]


def test_five_leaders_cross_because_the_flow_is_slow_and_not_because_a_multiplier_is_capped():
    """Without a cap every tick is the same; with thirty times the rounds nobody crosses."""
    capped = margins_of("distributed")
    assert min(capped) < -6.0
    assert margins_of("distributed", "governor.multiplier_cap=null") == capped
    assert min(margins_of("distributed", "governor.rounds=300", "governor.step=0.001")) > 0.1


def test_before_a_robot_crosses_its_row_is_broken_by_more_and_the_problem_has_no_solution():
    changes = ("team.leaders=[4,5]", "operator.reference=[20,30]", "timing.duration=6", "reference.period=0.01")
    run = pbrg.run(pbrg.load("paper/simulation_inadmissible", changes))
    beyond = (run.q_true_m @ NORMAL).max(axis=1) - OFFSET
    unsolved = np.isnan(run.optimum["m_star_m"][:, 0])
    assert beyond.max() > 0.2
    assert (beyond <= run.worst_row_m + 1e-9).all()
    assert not unsolved[0]
    assert unsolved[: np.argmax(beyond > 0.0)].any()


@pytest.mark.parametrize("kind", ["centralized", "certified"])
@pytest.mark.parametrize("seed", range(5))
def test_random_teams_with_up_to_five_leaders_keep_the_line_to_a_million_metres(kind, seed):
    rng = np.random.default_rng(seed)
    assert least_margin(random_team(rng, kind, farther=10.0 ** rng.uniform(0.0, 4.4))) > -1e-6
