"""The guard against what it promises: no applied reference breaks a row, whoever knows of it."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.guard import GuardedGovernor, admissible_radii
from pbrg_mj.governor.problem.ball import input_rows
from pbrg_mj.governor.problem.rows import Rows, row_values, stacked
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from tests.problems import FORMATION, GRAPHS, START, graph, problem, random_problem

WALL_OF_2 = [(1, [1, 1], 3.0)]  # known to robot 2 alone, which does not lead
P = 0.3 * (START - FORMATION)


def worst_on_the_circle(rows, i, states, centre, radius):
    angle = np.linspace(0, 2 * np.pi, 721)
    p, xi = states[i, :, :2], states[i, :, 2:]
    own = Rows(*(getattr(rows, name)[i : i + 1] for name in ("a", "C", "d", "active")))
    points = centre[i] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return max(row_values(own, m, p, xi).max() for m in points)


def test_the_radius_is_the_largest_whose_disc_is_admissible():
    rng = np.random.default_rng(2)
    bounded = forbidden = free = 0
    for _ in range(60):
        random = random_problem(rng)
        rows = stacked(random.rows, input_rows(graph(), 1.0, 8.0)) if rng.random() < 0.5 else random.rows
        states = 0.3 * rng.normal(size=(5, 5, 4))
        centre = states[:, :, :2].mean(axis=1)
        for i, radius in enumerate(admissible_radii(rows, states, centre)):
            if radius == np.inf:
                assert not rows.active[i].any()
                free += 1
            elif radius < 0:
                assert worst_on_the_circle(rows, i, states, centre, 0.0) > 0
                forbidden += 1
            else:
                assert worst_on_the_circle(rows, i, states, centre, radius) == pytest.approx(0.0, abs=1e-4)
                bounded += 1
    assert min(bounded, forbidden, free) > 10


@pytest.mark.parametrize("name", GRAPHS)
def test_whatever_the_optimizer_says_nothing_forbidden_is_applied(name):
    """The optimizer's estimates are thrown far beyond a wall that only robot 2 knows; nobody applies them."""
    static = problem(WALL_OF_2, P, [2.0, 3.0], graph(GRAPHS[name]))
    governor = GuardedGovernor(DistributedGovernor(Flow(2.0, 1e-3), 10, "start"))
    memory = governor.init(static)
    for _ in range(6):  # until robots at the ends of a path have heard of each other, and of robot 2's radius
        _, memory = governor.step(static, memory)
    z = memory.inner.estimates.z.copy()
    z[:, :2] = [5.0, 7.0]
    thrown = memory.inner.estimates._replace(z=z)
    memory = dataclasses.replace(memory, inner=memory.inner._replace(estimates=thrown))
    solution, _ = governor.step(static, memory)
    for m in solution.m:
        assert row_values(static.rows, m, static.p, static.xi).max() <= 1e-9
    unguarded, _ = governor.inner.step(static, memory.inner)
    assert row_values(static.rows, unguarded.m[4], static.p, static.xi).max() > 5.0


def test_an_admissible_answer_passes_unchanged():
    static = problem(WALL_OF_2, P, [0.05, 0.0])
    inner = DistributedGovernor(Flow(2.0, 1e-3), 10, "start")
    guarded, plain = GuardedGovernor(inner), inner
    memory, plain_memory = guarded.init(static), plain.init(static)
    for _ in range(300):
        solution, memory = guarded.step(static, memory)
        expected, plain_memory = plain.step(static, plain_memory)
    np.testing.assert_allclose(solution.m, expected.m, atol=1e-12)
    np.testing.assert_array_equal(solution.bytes_sent - expected.bytes_sent, 8 * 25 * graph().degree)


def test_states_and_radii_travel_one_hop_a_tick():
    static = problem(WALL_OF_2, P, [2.0, 3.0], graph(GRAPHS["path"]))
    governor = GuardedGovernor(DistributedGovernor(Flow(2.0, 1e-3), 10, "start"))
    memory = governor.init(static)
    for ticks in range(1, 7):
        _, memory = governor.step(static, memory)
        hops = np.abs(np.subtract.outer(np.arange(5), np.arange(5)))
        np.testing.assert_array_equal(memory.age < 1 << 30, hops < ticks)
        # robot 2 has heard of everyone after 4 ticks (robot 5 is 3 hops away); from then on its radius travels
        bound = (np.isfinite(memory.heard[:, 1, 4]) & (memory.age[:, 1] < 1 << 30)).tolist()
        np.testing.assert_array_equal(bound, hops[1] <= ticks - 4)


def test_a_wall_seen_late_is_not_touched(tmp_path, capsys):
    """In physics, at speed, with a leak against windup: the guard stops the team, the paper's governor does not."""
    scenario = ["run", "sensing/late_detection", "--duration", "20", "--json"]
    safe = ["--set", "governor.guard=true", "--set", "control.leak=0.5", "-o", str(tmp_path / "safe.mcap")]
    assert main([*scenario, *safe]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["true_margin_min_m"] > 0.05
    assert main([*scenario, "-o", str(tmp_path / "paper.mcap")]) == 1
    assert json.loads(capsys.readouterr().out)["outcome"] == "violated"


def called_back(distance, seconds=60.0):
    """How far the guarded team gets, [m], at rest `distance` before its line and called 4.5 m back; its statuses."""
    G, team, control = np.array([1.0, 1.0]) / np.sqrt(2.0), graph(), Control(alpha_r=1.0)
    start = G * (3.0 / np.sqrt(2.0) - (FORMATION @ G).max() - distance)
    p, xi, memory, statuses = np.tile(start, (5, 1)), np.zeros((5, 2)), None, set()
    governor = GuardedGovernor(DistributedGovernor(Flow(2.0, 1e-3, 20.0), 10, "start"))
    for _ in range(int(seconds / 0.01)):
        now = problem([(4, [1.0, 1.0], 3.0)], p, start - 4.5 * G, team, xi)
        memory = governor.init(now) if memory is None else memory
        solution, memory = governor.step(now, memory)
        statuses.add(solution.status)
        u, rate = pre_stabilise(team, control, p, xi, solution.m)
        p, xi = p + 0.01 * u, xi + 0.01 * rate
    return float(np.linalg.norm(p.mean(axis=0) - start)), statuses


def test_what_the_guard_does_not_hold():
    """docs/failure-modes.md says this: beyond its line a team stands still for ever, just before it it creeps."""
    stands, said = called_back(-0.005)
    assert stands < 0.005 and "inadmissible" in said
    creeps, _ = called_back(0.001)
    assert creeps < 0.1
    walks, said = called_back(0.5)
    assert walks > 4.0 and said == {"ok"}


def test_in_some_feasible_states_even_the_teams_mean_is_forbidden():
    rng, forbidden = np.random.default_rng(4), 0
    for _ in range(150):
        random = random_problem(rng)
        while ClarabelSolver().solve(random).status != "solved":
            random = random_problem(rng)
        states = np.tile(np.hstack([random.p, random.xi]), (5, 1, 1))
        centre = np.tile(random.p.mean(axis=0), (5, 1))
        forbidden += bool(np.any(admissible_radii(random.rows, states, centre) < 0))
    assert 3 <= forbidden <= 25
