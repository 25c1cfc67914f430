"""Wind-up is seen where wheels do not follow, not where they do, and ends where the leak bounds xi."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.team.wind_up import WindUpDetector, wind_up
from tests.problems import FORMATION, START, graph

TICK, TOLERANCE = 0.01, 0.05
RULE = WindUpDetector(math.exp(-TICK * 1.382), TICK, TOLERANCE)
P = START - FORMATION


def run(seconds, follow, leak=0.0, rule=RULE):
    """The pre-stabiliser before wheels that do `follow` times what u says: who winds up (T, n), and xi (T, n, 2)."""
    p, xi, states = P.copy(), np.zeros((5, 2)), []
    for _ in range(round(seconds / TICK)):
        u, rate = pre_stabilise(graph(), Control(leak=leak), p, xi, np.ones((5, 2)))
        states.append((p, xi, u))
        p, xi = p + TICK * follow * u, xi + TICK * rate
    p, xi, u = map(np.array, zip(*states, strict=True))
    return wind_up(rule, None, p, xi, u)[1], xi


def test_who_moves_at_u_never_winds_up():
    winding, xi = run(20.0, 1.0)
    assert np.linalg.norm(xi, axis=2).max() > 10 * TOLERANCE  # xi grows and shrinks all the same
    assert not winding.any()


@pytest.mark.parametrize(("share", "winds"), [(0.0, True), (0.45, True), (0.55, False)])
def test_half_of_the_way_decides(share, winds):
    assert run(3.0, share)[0].any() == winds


def test_stuck_wheels_wind_up_as_soon_as_xi_has_grown_by_the_length_and_for_ever():
    winding, xi = run(60.0, 0.0)
    grown = np.linalg.norm(xi, axis=2)
    rate = np.linalg.norm(graph().laplacian @ P, axis=1)  # [m/s], constant while p is
    np.testing.assert_allclose(grown[-1], rate * 59.99, rtol=1e-9)
    # The weights sum to (1 - keep^k) / (1 - keep) ticks, keep times: solved for the length, and the first tick after.
    keep = RULE.keep
    needed = np.log(1 - TOLERANCE * (1 - keep) / (keep * TICK * rate)) / np.log(keep)
    first = np.argmax(winding, axis=0)
    np.testing.assert_array_equal(first[:4], np.ceil(needed[:4]))  # the leader's way, not its xi, comes last
    assert winding[first.max() :].all()


def test_only_the_stuck_one_winds_up():
    winding, _ = run(20.0, np.array([[1.0], [1.0], [0.0], [1.0], [1.0]]))
    np.testing.assert_array_equal(winding.any(axis=0), [False, False, True, False, False])


def test_with_a_leak_stuck_wheels_stop_winding_up_where_theory_bounds_xi():
    leak = 0.5
    winding, xi = run(60.0, 0.0, leak)
    np.testing.assert_allclose(xi[-1], -(P - P.mean(axis=0)) / leak, atol=1e-6)
    assert winding[:100].any()
    # xi comes to its bound at leak lambda_2 = 0.69 1/s or faster: from here on it grows by less than the length
    reach = np.linalg.norm(P - P.mean(axis=0)) / leak
    assert not winding[round(np.log(reach / TOLERANCE) / 0.69 / TICK) :].any()


def test_a_robot_depends_on_itself_alone():
    rng = np.random.default_rng(3)
    p, xi, u = rng.normal(size=(3, 40, 5, 2))
    xi = np.cumsum(0.02 * np.abs(xi), axis=0)
    results = []
    for changed in (0.0, 1.0):
        others = changed * rng.normal(size=(40, 5, 2))
        others[:, 2] = 0.0
        memory, winding = wind_up(RULE, None, p + others, xi + others, u + others)
        results.append((winding[:, 2].tolist(), memory.sums[2].tolist()))
    assert results[0] == results[1]
    assert any(results[0][0])


@pytest.mark.parametrize("sizes", [[1] * 40, [1, 7, 32], [39, 1]])
def test_it_does_not_matter_how_many_ticks_are_told_at_once(sizes):
    rng = np.random.default_rng(5)
    p, u = rng.normal(size=(2, 40, 5, 2))
    xi = np.cumsum(0.02 * np.abs(rng.normal(size=(40, 5, 2))), axis=0)
    whole, expected = wind_up(RULE, None, p, xi, u)
    memory, found = None, []
    for end, size in zip(np.cumsum(sizes), sizes, strict=True):
        some = slice(end - size, end)
        memory, winding = wind_up(RULE, memory, p[some], xi[some], u[some])
        found.append(winding)
    np.testing.assert_array_equal(np.concatenate(found), expected)
    np.testing.assert_array_equal(memory.sums, whole.sums)
    assert expected.any()


def test_the_rule_of_a_scenario():
    rule = WindUpDetector.of(load_scenario("paper/simulation_near").scenario, graph())
    assert (rule.tick, rule.length) == (0.01, 0.05)
    assert -math.log(rule.keep) / 0.01 == pytest.approx(2 - 2 * math.cos(2 * math.pi / 5))  # lambda_2 of the ring


def records(*changes):
    shorter = ["reference.solver=none", "timing.duration=8"]
    scenario = load_scenario("disturbances/dead_motor", [*shorter, *changes]).scenario
    return np.array([record.winding_up for record in Simulation.build(scenario).records()])


def test_in_physics_a_dead_motor_is_told_and_a_free_run_is_silent_once_it_drives():
    """The motors saturate in the first two seconds; later only the robot whose left wheel dies at 3 s winds up."""
    dead, free = records(), records("disturbances.dead_motors=[]")
    assert not free[200:].any()
    assert dead[300:, 2].sum() > 100
    assert not dead[200:, [0, 1, 3, 4]].any()
