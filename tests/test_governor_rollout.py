"""The rollout governor: predictions against matrix powers, intervals against the predictive certificate, messages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor
from pbrg_mj.governor.rollout.bounds import rollout_bounds
from pbrg_mj.governor.rollout.messages import HalfSpace, Key
from pbrg_mj.governor.rollout.plan import RolloutPlan, step_weights
from pbrg_mj.governor.rollout.robot import RolloutProgram
from pbrg_mj.governor.rollout.team import Cycle, run_cycle
from pbrg_mj.governor.rollout.verdicts import Verdict, advance
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control, Scenario
from pbrg_mj.team.channel import Channel, Loss
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network

GRAPHS = {
    "path of 3": (3, [(0, 1), (1, 2)], [0, 0, 1]),
    "ring of 5": (5, [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)], [0, 0, 0, 0, 1]),
    "complete of 4, two leaders": (4, [(i, j) for i in range(4) for j in range(i + 1, 4)], [1, 0, 0, 1]),
}
CONTROL = Control(alpha_r=2.5, leak=0.05)


def team_of(name: str) -> Network:
    _, edges, leader = GRAPHS[name]
    return network_of_edges(edges, np.array(leader, dtype=float))


def plan_of(team: Network, model: TeamModel, order: int, ticks: int, seconds: float, hold: int = 0) -> RolloutPlan:
    weights = step_weights(order, ticks)
    steps = int(np.ceil((seconds / model.tick + hold) / ticks))
    bounds = rollout_bounds(model, weights, steps)
    return RolloutPlan(
        gains=(CONTROL.alpha_r, CONTROL.leak, model.tick),
        formation=np.random.default_rng(5).normal(size=(team.robots, 2)),
        margin=0.01,
        weights=weights,
        steps=steps,
        error=bounds.error,
        from_start=bounds.remaining[-1],
        from_hold=bounds.remaining[len(bounds.remaining) - 1 - hold],
        diameter=team.diameter,
        cycle_ticks=hold + 1,
    )


def cycle_of(
    team: Network, plan: RolloutPlan, p, xi, held, half_spaces: dict[Key, HalfSpace]
) -> tuple[Cycle, np.ndarray]:
    found = run_cycle(plan, team.arrays, (p, xi), np.full(2, np.nan), half_spaces, None)
    return run_cycle(plan, team.arrays, (p, xi), held, half_spaces, found.response), found.response


def random_state(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    xi = 0.2 * rng.normal(size=(n, 2))
    return rng.normal(size=(n, 2)), xi - xi.mean(axis=0), rng.normal(size=2)


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize(("order", "ticks"), [(1, 1), (3, 3), (8, 40)])
def test_the_step_response_is_that_of_matrix_powers(name: str, order: int, ticks: int) -> None:
    team = team_of(name)
    model = TeamModel.of(team, CONTROL, 0.01)
    plan = plan_of(team, model, order, ticks, 3.0)
    p, xi, held = random_state(np.random.default_rng(31), team.robots)
    _, response = cycle_of(team, plan, p, xi, held, {})
    x, worst = np.zeros(2 * team.robots), 0.0
    for t in range(len(response)):
        beyond = np.abs(response[t] - x[: team.robots]) - plan.error[t]
        worst = max(worst, beyond.max())
        x = model.at_rest + model.step @ (x - model.at_rest)
    assert worst <= 1e-12
    assert plan.error.max() == pytest.approx(0.0, abs=1e-13) or order < ticks


@pytest.mark.parametrize("name", GRAPHS)
def test_the_bounds_hold_for_the_worst_state(name: str) -> None:
    """Rows of signs are the worst states of norm 1; there the bound of a position is met."""
    team = team_of(name)
    model, n = TeamModel.of(team, CONTROL, 0.01), team.robots
    bounds = rollout_bounds(model, step_weights(2, 12), 20)
    change = model.step - np.eye(2 * n)
    rolled = np.eye(2 * n) + 12 * change + 66 * change @ change
    true = np.linalg.matrix_power(model.step, 240)
    worst = np.abs((np.linalg.matrix_power(rolled, 20) - true)[:n]).sum(axis=1)
    np.testing.assert_allclose(bounds.error[240], worst, rtol=1e-9)
    later = [np.abs(np.linalg.matrix_power(model.step, t)[:n]).sum(axis=1) for t in range(240, 2500, 7)]
    assert (np.max(later, axis=0) <= bounds.remaining[240] * (1 + 1e-12)).all()
    assert (bounds.remaining[240] <= np.max(later, axis=0) * 1.05).all()


@pytest.mark.parametrize("name", GRAPHS)
def test_with_eulers_steps_of_a_tick_the_intervals_are_those_of_the_predictive_certificate(name: str) -> None:
    team, rng, bound = team_of(name), np.random.default_rng(32), 0
    n, model = team.robots, TeamModel.of(team, CONTROL, 0.01)
    grid = PredictionGrid.of(model, between=0.0)  # every tick
    plan, nothing = plan_of(team, model, 1, 1, grid.horizon * 0.01), np.zeros(n)
    # Without the bounds of the tail, which are in two norms.
    plan = replace(plan, from_start=nothing, from_hold=nothing)
    certificate = PredictiveCertificate(replace(grid, bound=0.0 * grid.bound), plan.formation, plan.margin)
    for _ in range(6):
        p, xi, held = random_state(rng, n)
        spaces, half_spaces = HalfSpaces.empty(n, 1), {}
        for i in range(n):
            angle, binds_all = rng.uniform(0, 2 * np.pi), bool(rng.random() < 0.5)
            G = np.array([np.cos(angle), np.sin(angle)])
            h = float((G @ (p + plan.formation).T).max() + rng.uniform(-0.3, 2.0))
            spaces.G[i, 0], spaces.h[i, 0], spaces.active[i, 0] = G, h, True
            spaces.binds[i, 0] = True if binds_all else np.arange(n) == i
            half_spaces[i, 0] = HalfSpace(binds_all, float(G[0]), float(G[1]), h)
        rows = certificate.rows_at(spaces, p, xi, held)
        cycle, _ = cycle_of(team, plan, p, xi, held, half_spaces)
        for i in range(n):
            at = spaces.G[i, 0] @ held
            high = rows.d[i, 0] - at if rows.active[i, 0] else np.inf
            found = cycle.verdicts[i, 0]
            assert found.high == pytest.approx(high, abs=1e-9)
            bound += abs(high) < 1e6
    assert bound > n


def crossing(scenario: Scenario) -> tuple[float, float, set[str]]:
    """Run the ideal plant; return by how much anybody crosses, the gap of m to the optimum, and the statuses."""
    formation, worst, statuses, tick = np.array(scenario.team.formation), -np.inf, set(), None
    for tick in Simulation.build(scenario).control_ticks():
        spaces = tick.half_spaces
        values = spaces.G @ (tick.problem.p + formation).T - spaces.h[:, :, None]
        worst = max(worst, float(np.where(spaces.binds, values, -np.inf).max()))
        if tick.time >= 3.0:
            statuses.add(tick.solution.status)
    m = tick.solution.m[scenario.team.leaders[0] - 1]
    return worst, float(np.linalg.norm(m - np.array([1.0, 2.0]))), statuses


def rollout(name: str, *overrides: str) -> Scenario:
    keys = ["governor.kind=rollout", "governor.certificate=predictive", "reference.solver=none", *overrides]
    return load_scenario(name, keys).scenario


@pytest.mark.parametrize("name", ["obstacles/corner", "team/two_leaders"])
def test_the_team_at_once_is_the_robots_program_bit_for_bit(name: str) -> None:
    scenario = rollout(name, "timing.duration=0.4", "governor.rounds=40")
    ours = governor(scenario)
    carried = NetworkedGovernor(RolloutProgram(ours.plan), scenario.governor.rounds)
    one = other = None
    for tick in Simulation.build(scenario).control_ticks():
        one = ours.init(tick.problem) if one is None else one
        other = carried.init(tick.problem) if other is None else other
        mine, one = ours.step(tick.problem, one)
        theirs, other = carried.step(tick.problem, other)
        np.testing.assert_array_equal(mine.m, theirs.m)
        np.testing.assert_array_equal(mine.bytes_sent, theirs.bytes_sent)
        assert (mine.status, mine.rounds) == (theirs.status, theirs.rounds)
    assert tick.index > 3 * ours.plan.cycle_ticks


def test_messages_are_as_long_as_the_page_says_for_any_team() -> None:
    """A hundred robots send what five send: 34 bytes a neighbour and round of the rollout."""
    scenario = rollout("paper/simulation_inadmissible", "timing.duration=0.2", "estimator.given.0.robot=2")
    ours = governor(scenario)
    *_, last = Simulation.build(scenario).control_ticks()
    assert (last.solution.bytes_sent == 34 * 10 * 2).all()
    assert ours.plan.rounds_of_an_exchange == 1


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 8])
def test_nobody_crosses_and_m_comes_to_the_optimum(order: int) -> None:
    keys = [f"governor.rollout_order={order}", "governor.rounds=200", "timing.duration=25", "timing.tick=0.02"]
    worst, gap, statuses = crossing(rollout("paper/simulation_inadmissible", "estimator.given.0.robot=2", *keys))
    assert worst <= 1e-9
    assert gap < 0.01
    assert statuses == {"ok"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "network_keys",
    [
        ["network.delay_rounds=1", "network.jitter_rounds=1"],
        ["network.loss=0.05"],
        ["network.outages=[{robot: 2, time: 3.0, duration: 2.0}]"],
    ],
)
def test_no_delay_and_no_loss_makes_anybody_cross(network_keys: list[str]) -> None:
    """Though another robot than the leader sees the wall."""
    keys = ["timing.duration=7", "timing.tick=0.05", "governor.rounds=30", "control.alpha_r=2.5", *network_keys]
    worst, gap, statuses = crossing(rollout("paper/simulation_inadmissible", "estimator.given.0.robot=2", *keys))
    assert worst <= 1e-9
    assert gap < 0.6
    assert statuses <= {"ok", "holding"}
    assert "holding" in statuses or not any("outages" in key for key in network_keys)


def test_whatever_is_lost_a_leader_moves_by_everybodys_verdicts_or_not_at_all() -> None:
    """Four of ten cycles lack no message; of the others, those that lack one late are the ones to be afraid of."""
    team, rng = team_of("ring of 5"), np.random.default_rng(33)
    n, model = 5, TeamModel.of(team, CONTROL, 0.05)
    plan = plan_of(team, model, 8, 8, 1.0)
    p, xi, _ = random_state(rng, n)
    spaces = HalfSpaces.empty(n, 1)
    spaces.G[2, 0], spaces.h[2, 0], spaces.active[2, 0], spaces.binds[2, 0] = [0.6, 0.8], 4.0, True, True
    rows = Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))
    reference = np.array([50.0, 50.0])
    problem = Problem(team, p, xi, rows, reference, spaces, np.zeros(n))
    links = len(team.neighbours)
    nobody = np.zeros((0, 3), dtype=np.int64)
    lossy = Channel(np.zeros(links, dtype=np.int64), 0.0, Loss.independent(0.003), 7, nobody, 1)
    carried = NetworkedGovernor(RolloutProgram(plan), plan.exchanges, lossy)
    memory, moved, response, half_spaces = carried.init(problem), 0, None, {(2, 0): HalfSpace(True, 0.6, 0.8, 4.0)}
    for _ in range(60):
        held = memory.robots[4].held
        solution, memory = carried.step(problem, memory)
        if memory.robots[4].status == "holding":
            np.testing.assert_array_equal(memory.robots[4].held, held)
            continue
        cycle = run_cycle(plan, team.arrays, (p, xi), held, half_spaces, response)
        response = cycle.response
        expected = cycle.summary.centre
        if cycle.verdicts is not None:
            expected = held + advance(reference - held, cycle.verdicts, cycle.summary.centre - held, np.inf)[0]
        np.testing.assert_array_equal(solution.m[4], expected)
        moved += 1
    assert 15 < moved < 50


def test_an_aim_too_far_from_the_team_is_the_point_so_far_on_the_way_to_it() -> None:
    wall, team = {(0, 0): Verdict(0.6, 0.8, -np.inf, 1.0)}, np.array([0.2, -0.1])
    for aim in (np.array([3.0, 2.0]), np.array([3e5, 2e5]), np.array([-4e3, -1e3])):
        away = np.linalg.norm(aim - team)
        near = aim if away <= 20.0 else team + 20.0 * (aim - team) / away
        found, status = advance(aim, wall, team, np.inf, 20.0)
        assert status == "ok"
        np.testing.assert_allclose(found, near - max(0.0, near @ [0.6, 0.8] - 1.0) * np.array([0.6, 0.8]), atol=1e-9)


def test_rounds_too_few_to_be_ahead_of_time_are_refused() -> None:
    with pytest.raises(pbrg.InputError, match=r"governor.rounds: is 1, by which a rollout takes more than 1000 ticks"):
        governor(rollout("paper/simulation_inadmissible", "governor.rounds=1", "governor.rollout_order=1"))
