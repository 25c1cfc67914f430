"""The team as it is sampled: how far rho may grow, which ticks are stable, and what `sampled_ball` keeps."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.rows import row_values
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.checks.sampling import _longest_tick, _sufficient_tick
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.graph import network, network_of_edges
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.team.sampled import sampled_growth, sampled_map
from tests.problems import half_spaces

COMPLETE_12 = ("graph.kind=complete", "plant=ideal")


def random_team(rng, most=8):
    n = int(rng.integers(2, most))
    edges = {(int(rng.integers(k)), k) for k in range(1, n)} | {
        (i, k) for i in range(n) for k in range(i + 1, n) if rng.random() < 0.3
    }
    leader = np.zeros(n)
    leader[rng.permutation(n)[: rng.integers(1, n + 1)]] = 1.0
    return network_of_edges(sorted(edges), leader), sorted(edges)


def twelve(*overrides, tick=0.05):
    """Twelve robots that all hear each other, in the ideal plant."""
    start = [[float(np.cos(a)), float(np.sin(a))] for a in np.arange(12)]
    given = (f"team.start={start}", f"team.formation={start}", "team.leaders=[1]", f"timing.tick={tick}")
    return load_scenario("paper/simulation_near", (*given, *COMPLETE_12, "estimator.given=[]", *overrides)).scenario


@pytest.mark.parametrize("seed", range(8))
def test_no_place_and_no_u_exceeds_its_factor_and_some_state_reaches_it(seed):
    rng = np.random.default_rng(seed)
    team, edges = random_team(rng)
    control = Control(alpha_r=float(rng.uniform(0.3, 3.0)), leak=float(rng.choice([0.0, 0.4])))
    n, leaders = team.robots, np.flatnonzero(team.leader).tolist()
    tick = float(rng.uniform(0.1, 0.98)) * _longest_tick(edges, team.degree, leaders, control)
    of_places, of_inputs = sampled_growth(team, control, tick)
    B = sampled_map(team, control, tick)
    zero_sum = np.eye(2 * n)
    zero_sum[n:, n:] -= 1.0 / n
    rows = np.vstack(
        [np.eye(n, 2 * n), (B - np.eye(2 * n))[:n] / np.linalg.norm((B - np.eye(2 * n))[:n], axis=1)[:, None]]
    )
    largest = np.ones(2 * n)
    for ticks in range(1, 400):
        for j, row in enumerate(rows @ np.linalg.matrix_power(B, ticks) @ zero_sum):
            p, xi = np.zeros((n, 2)), np.zeros((n, 2))  # the unit state that is farthest along this row by then
            p[:, 0], xi[:, 0] = np.split(row / np.linalg.norm(row), 2)
            if ticks < 12:
                for _ in range(ticks):
                    u, rate = pre_stabilise(team, control, p, xi, np.zeros((n, 2)), "numpy")
                    p, xi = p + tick * u, xi + tick * rate
                assert rows[j] @ np.concatenate([p[:, 0], xi[:, 0]]) == pytest.approx(np.linalg.norm(row), abs=1e-9)
            largest[j] = max(largest[j], np.linalg.norm(row))
    assert of_places == pytest.approx(largest[:n].max(), abs=1e-9)
    np.testing.assert_allclose(of_inputs, largest[n:], atol=1e-9)


def test_a_long_chain_is_followed_only_while_a_row_can_still_grow(monkeypatch):
    n, leader = 60, np.eye(60)[20]
    chain = network_of_edges([(k, k + 1) for k in range(n - 1)], leader)
    control, norm, norms = Control(alpha_r=2.5), np.linalg.norm, []
    monkeypatch.setattr(np.linalg, "norm", lambda *given, **more: (norms.append(1), norm(*given, **more))[1])
    of_places, of_inputs = sampled_growth(chain, control, 0.1)
    assert len(norms) < 300  # of 131072 ticks that hold the supremum
    B = sampled_map(chain, control, 0.1)
    rows, first = B[:n] - np.eye(n, 2 * n), norm(B[:n] - np.eye(n, 2 * n), axis=1)
    grown = [norm(rows @ np.linalg.matrix_power(B, ticks), axis=1) / first for ticks in range(300)]
    np.testing.assert_allclose(of_inputs, np.max(grown, axis=0), rtol=1e-9)
    assert of_places == 1.0


def test_at_the_ticks_of_all_bundled_scenarios_the_ball_loses_nothing():
    """Bit for bit the paper's row, though rho itself grows by 0.33 % on its ring."""
    for name in sorted(bundled_scenarios()):
        plan = load_scenario(name, []).scenario
        if plan.robots <= 20:
            assert BallCertificate.of(plan, network(plan)).growth == 1.0
    plan = load_scenario("paper/simulation_near", []).scenario
    B, n = sampled_map(network(plan), plan.control, plan.timing.tick), 5
    zero_sum = np.eye(2 * n)
    zero_sum[n:, n:] -= 1.0 / n
    grown = [np.linalg.norm(np.linalg.matrix_power(B, k) @ zero_sum, 2) for k in range(1, 50)]
    assert max(grown) == pytest.approx(1.0033, abs=5e-5)


def test_at_a_long_tick_the_ball_takes_the_factor_and_so_keeps_every_line():
    """States that reach farthest under one m touch the line and do not cross it; with rho alone they would."""
    plan = load_scenario("paper/simulation_near", ["timing.tick=0.25", "reference.period=0.25"]).scenario
    team, control, tick, n = network(plan), plan.control, plan.timing.tick, 5
    certificate = BallCertificate.of(plan, team)
    assert certificate.growth > 1.01
    zero_sum = np.eye(2 * n)
    zero_sum[n:, n:] -= 1.0 / n
    B, passed = sampled_map(team, control, tick), []
    for ticks in range(1, 30):
        for j, row in enumerate(np.linalg.matrix_power(B, ticks)[:n] @ zero_sum):
            x = row / np.linalg.norm(row)
            p, xi = np.zeros((n, 2)), np.zeros((n, 2))
            p[:, 0], xi[:, 0] = np.split(x, 2)
            line = certificate.growth + certificate.formation[j, 0]
            spaces = half_spaces([(0, [1.0, 0.0], line)], n, 1)
            spaces.binds[:] = False
            spaces.binds[0, 0, j] = True
            assert row_values(certificate.rows(spaces), np.zeros(2), p, xi).max() == pytest.approx(0.0, abs=1e-9)
            passed.append((np.linalg.matrix_power(B, ticks) @ x)[j] - certificate.growth)
    assert max(passed) == pytest.approx(0.0, abs=1e-9)  # touched, not crossed


def test_a_tick_at_which_the_pre_stabiliser_runs_away_is_refused_in_one_line(capsys):
    with pytest.raises(
        InputError, match=r"timing\.tick.*is 0\.1 s, at which the pre-stabiliser \(eq\. 2\) is unstable"
    ):
        twelve(tick=0.1)
    assert twelve("reference.period=0.08", "timing.duration=0.8", tick=0.08).timing.tick == 0.08  # 1 / 12 = 0.083
    assert main(["validate", "paper/simulation_near"]) == 0
    capsys.readouterr()
    arguments = ["--set", "timing.tick=0.4", "--set", "reference.period=0.4", "--quiet"]
    assert main(["run", "paper/simulation_near", *arguments]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "timing.tick" in line and "allowed: less than 0.27" in line


@pytest.mark.parametrize("leak", [0.0, 0.7, 5.0])
def test_the_longest_tick_is_where_the_sampled_team_turns_unstable(leak):
    rng = np.random.default_rng(5)
    for _ in range(40):
        team, edges = random_team(rng)
        control = Control(alpha_r=float(10 ** rng.uniform(-1, 2)), leak=leak)
        leaders = np.flatnonzero(team.leader).tolist()
        longest = _longest_tick(edges, team.degree, leaders, control)
        for share, stable in ((0.999, True), (1.001, False)):
            modes = np.linalg.eigvals(sampled_map(team, control, share * longest))
            moving = modes[np.abs(modes - 1.0) > 1e-9]
            assert (np.abs(moving).max() < 1.0) == stable
        if leak == 0.0:  # the theorem
            assert _sufficient_tick(edges, team.degree, leaders, control) <= longest * (1 + 1e-4)


def test_large_teams_are_judged_by_the_two_conditions():
    places = [[float(k), 0.0] for k in range(400)]
    given = [f"team.start={places}", f"team.formation={places}", "team.leaders=[1]", "estimator.given=[]"]
    assert load_scenario("paper/simulation_near", given).scenario.robots == 400
    with pytest.raises(InputError, match=r"timing\.tick.*allowed: less than 0\.25 s"):
        load_scenario("paper/simulation_near", [*given, "timing.tick=0.3", "reference.period=0.3"])
