"""Silent robots: reported, the rest hold within graph distance, and go on by themselves when all speak again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.channel import NEVER
from tests.channels import channel, links, quiet, run, uneven
from tests.problems import GRAPHS, graph, problem
from tests.test_governor_static import WALLS, XI, P

FLOW = Flow(2.0, 5e-3)
PATIENCE = 12
FROM, UNTIL = 100, 220


def silenced(name, robot, delay=0, impedance=0.0, until=UNTIL):
    frozen = problem(WALLS[1], P, [2.0, 3.0], graph(GRAPHS[name]), XI)
    outage_rounds = [(robot, FROM, until)]
    return frozen, channel(frozen.network, delay, impedance, outage_rounds=outage_rounds, silent_after=PATIENCE)


def freezing(network, delays, robot):
    """The first round in which each robot holds, if robot falls silent in round FROM; -1 for never.

    A neighbour's last message comes in round FROM - 1 + delay and is missed for PATIENCE rounds; from there the news
    takes a link's delay and one round per hop, over links that are up. The silent robot hears nobody at all.
    """
    first = np.full(network.robots, NEVER // 2)
    ends = list(zip(links(network), delays.tolist(), strict=True))
    for (i, k), delay in ends:
        if k == robot:
            first[i] = min(first[i], FROM - 1 + delay + PATIENCE)
        if i == robot:
            first[i] = min(first[i], FROM - 1 + PATIENCE)
    for _ in range(network.robots):
        for (i, k), delay in ends:
            if robot not in (i, k):
                first[i] = min(first[i], first[k] + 1 + delay)
    return first


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize(("delay", "impedance"), [(0, 0.0), (uneven, 0.0), (uneven, 2.0)])
@pytest.mark.parametrize("robot", [2, 4])
def test_the_rest_hold_as_soon_as_the_news_can_reach_them(name, delay, impedance, robot):
    frozen, links_ = silenced(name, robot, delay, impedance)
    expected = freezing(frozen.network, links_.delay, robot)
    memory = quiet(links_, DistributedGovernor(FLOW, 1, "start", links_).init(frozen).estimates)
    stood, held = np.zeros((2, UNTIL, 5), dtype=bool)
    for t in range(UNTIL):
        before = memory[0]
        memory = run(frozen, memory, links_, FLOW, 1)
        stood[t] = np.all(memory[0].z == before.z, axis=1)
        held[t] = memory[1].holding
    for i in range(5):
        assert held[expected[i] :, i].all(), i
        assert not held[20 : expected[i], i].any(), i
    if not impedance:
        np.testing.assert_array_equal(stood[20:], held[20:])
    else:  # without new waves they stand at once, the neighbours first
        assert not stood[20:FROM].any()
        assert stood[held].all()
        others = [i for i in range(5) if i != robot]
        assert all(stood[FROM + 4 + 5 * 5 :, i].all() for i in others)
    assert expected.max() <= FROM - 1 + 4 + PATIENCE + 4 * 5


def test_lost_neighbours_are_counted_on_both_sides_and_reported():
    frozen, links_ = silenced("kite", 2)
    governor = DistributedGovernor(FLOW, FROM + PATIENCE - 1, "start", links_)
    solution, memory = governor.step(frozen, governor.init(frozen))
    assert (solution.status, solution.lost.tolist()) == ("ok", [0, 0, 0, 0, 0])
    next_round = dataclasses.replace(governor, rounds=1)
    solution, memory = next_round.step(frozen, memory)
    assert (solution.status, solution.lost.tolist()) == ("holding", [1, 1, 3, 1, 0])  # 5 has not heard of it yet
    solution, memory = dataclasses.replace(governor, rounds=UNTIL - FROM - PATIENCE).step(frozen, memory)
    assert (solution.status, solution.lost.tolist()) == ("holding", [1, 1, 3, 1, 0])
    solution, memory = next_round.step(frozen, memory)
    assert (solution.status, solution.lost.tolist()) == ("holding", [0, 0, 0, 0, 0])  # echoes have to die out
    solution, memory = dataclasses.replace(governor, rounds=5).step(frozen, memory)
    assert solution.status == "ok"


def test_without_silence_nobody_is_lost_though_messages_take_longer_than_patience():
    frozen, links_ = silenced("ring", 2, 3 * PATIENCE, until=FROM)
    governor = DistributedGovernor(FLOW, 1, "start", links_)
    memory = governor.init(frozen)
    for _ in range(6 * PATIENCE):
        solution, memory = governor.step(frozen, memory)
        assert (solution.status, solution.lost.sum()) == ("ok", 0)


@pytest.mark.parametrize("impedance", [0.0, 2.0])
@pytest.mark.parametrize("robot", [1, 4])
def test_when_it_speaks_again_the_network_finds_the_optimum(robot, impedance):
    frozen, links_ = silenced("ring", robot, uneven, impedance)
    governor = DistributedGovernor(FLOW, UNTIL, "start", links_)
    solution, memory = governor.step(frozen, governor.init(frozen))
    assert solution.status == "holding"
    solution, memory = dataclasses.replace(governor, rounds=5 * 5 + 4).step(frozen, memory)
    assert solution.status == "ok"
    solution, _ = dataclasses.replace(governor, rounds=60_000).step(frozen, memory)
    np.testing.assert_allclose(solution.m, np.tile(ClarabelSolver().solve(frozen).m, (5, 1)), atol=1e-4)


def closed_loop(robot, graph_kind, duration):
    """The paper's first run with one robot silent from 3 s on, as records."""
    outage_rounds = f"network.outages=[{{robot: {robot}, time: 3, duration: {duration}}}]"
    changes = [f"graph.kind={graph_kind}", outage_rounds, "network.neighbour_timeout=0.2", "timing.duration=12"]
    scenario = load_scenario("paper/simulation_near", changes).scenario
    return list(Simulation.build(scenario).records())


@pytest.mark.parametrize(("robot", "graph_kind"), [(1, "ring"), (3, "path"), (5, "ring")])
def test_a_team_that_lost_a_robot_stands_still_in_safety_and_then_goes_on(robot, graph_kind):
    """Also when the path falls in two, and when the lost one is the leader itself."""
    records = closed_loop(robot, graph_kind, 4)
    assert records[318].solution.status == "ok"
    held = records[320:700]
    for record in held:
        assert record.solution.status == "holding"
        assert record.solution.lost.sum() >= 2
        np.testing.assert_array_equal(record.solution.m, held[0].solution.m)
    storage = np.array([record.operation.storage for record in held])
    assert np.all(np.diff(storage) <= 1e-12)
    assert storage[-1] < 0.6 * storage[0]
    worst = np.array([record.operation.worst_row for record in held])
    assert np.all(np.diff(worst) <= 1e-12)  # what holds goes on holding
    if graph_kind == "ring":  # the path's slower network had overshot when it was frozen
        assert worst[-1] < 0.0
    for record in held:  # no robot behind the wall
        walls = record.half_spaces
        beyond = np.einsum("iks,js->ikj", walls.G, record.hand_world) - walls.h[..., None]
        assert beyond[walls.active].max() < 0.0
    assert records[710].solution.status == "ok"
    assert np.linalg.norm(records[-1].solution.m[4] - held[0].solution.m[4]) > 0.05
