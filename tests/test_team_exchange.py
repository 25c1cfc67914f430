"""The pre-stabiliser's messages, late and lost: what robots use, and when the team is stable."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.loop.batch import BatchSimulation
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.loop.stability_warnings import stability_warnings
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.exchange import Exchange, StateMessages, exchange
from pbrg_mj.team.graph import network, network_of_edges
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.team.sampled import continuous_map, delay_margin, growing_modes, sampled_map

KEYS = "network.pre_stabiliser."


def scenario_of(*keys, name="paper/simulation_near"):
    return load_scenario(name, ["governor.kind=none", "reference.solver=none", *keys]).scenario


def exchange_of(*keys) -> Exchange:
    found = exchange(scenario_of(*keys))
    assert found is not None
    return found


def test_by_default_all_of_it_arrives_at_once():
    assert exchange(scenario_of()) is None


def test_states_cost_32_bytes_a_link_and_tick_lost_or_not_and_nothing_while_a_robot_is_silent():
    """The paper's ring has two links a robot; robot 2 is silent from tick 10 to 17, robot 5 from 15 on."""
    outages = "outages=[{robot: 2, time: 0.1, duration: 0.08}, {robot: 5, time: 0.15}]"
    messages = StateMessages.of(scenario_of(f"{KEYS}loss=0.5", KEYS + outages))
    expected = np.full((30, 5), 64)
    expected[10:18, 1] = expected[15:, 4] = 0
    np.testing.assert_array_equal(np.vstack([messages.sent(0, 13), messages.sent(13, 17)]), expected)
    np.testing.assert_array_equal(StateMessages.of(scenario_of()).sent(100, 3), np.full((3, 5), 64))


def test_messages_in_time_give_the_rates_of_the_kernel_bit_for_bit():
    late = exchange_of(f"{KEYS}delay_ticks=1")
    at_once = Exchange(late.network, dataclasses.replace(late.channel, delay=np.zeros_like(late.channel.delay)))
    control, rng, memory = Control(alpha_r=1.7, leak=0.3), np.random.default_rng(31), at_once.empty()
    for _ in range(5):
        p, xi, m = rng.normal(size=(3, 5, 2))
        memory = at_once.transmitted(p, xi, memory)
        for ours, theirs in zip(
            at_once.rates(control, (p, xi), m, memory), pre_stabilise(late.network, control, p, xi, m), strict=True
        ):
            assert ours.tobytes() == theirs.tobytes()


def test_robots_use_what_was_sent_last_of_what_has_come():
    """Against a table of all messages, with jitter, loss and an outage."""
    one = exchange_of(
        *(f"{KEYS}{key}" for key in ("delay_ticks=2", "jitter_ticks=4", "loss=0.3", "loss_burst=3")),
        KEYS + "outages=[{robot: 2, time: 0.1, duration: 0.08}]",
        "seed=17",
    )
    net, channel, memory = one.network, one.channel, one.empty()
    links, bad, last = len(net.neighbours), np.zeros(len(net.neighbours), dtype=bool), np.full(10, -1)
    arrivals = channel.arrivals(last, 0, 60)
    lost, silent = channel.lost(bad, 0, 60), channel.silent(0, 60, 5)
    assert lost.any() and silent.sum() == 8
    rng = np.random.default_rng(5)
    states = rng.normal(size=(60, 5, 4))
    newest = np.full(links, -1)
    for now in range(60):
        memory = one.transmitted(states[now, :, :2], states[now, :, 2:], memory)
        for e in range(links):
            came = [
                t
                for t in range(now + 1)
                if arrivals[t, e] == now and not lost[t, e] and not silent[t, net.neighbours[e]]
            ]
            if came and not silent[now, net.receiver[e]]:
                newest[e] = max(newest[e], *came)
            if newest[e] >= 0:
                np.testing.assert_array_equal(memory.received[e], states[newest[e], net.neighbours[e]])
        np.testing.assert_array_equal(memory.received_tick, newest)


def test_own_losses_leave_the_governors_as_they_are():
    ours, theirs = (scenario_of("network.loss=0.5", *keys) for keys in ((), (f"{KEYS}loss=0.5",)))
    assert exchange_of(f"{KEYS}loss=0.5").channel.sources[0].name == "PRE_STABILISER_MESSAGES"
    assert ours.network.loss == theirs.network.loss


def delayed_map(team, control, tick, delay):
    """The map of (x(t), x(t - 1), ..., x(t - d)), x = (p - 1 m, xi) of one axis."""
    n, A = team.robots, tick * continuous_map(team, control)
    own = np.kron(np.ones((2, 2)), np.eye(n)) * A
    late = np.zeros((2 * n * (delay + 1), 2 * n * (delay + 1)))
    late[2 * n :, : -2 * n] = np.eye(2 * n * delay)
    late[: 2 * n, : 2 * n] = np.eye(2 * n) + own
    late[: 2 * n, -2 * n :] += A - own
    return late


@pytest.mark.parametrize("seed", range(6))
def test_growing_modes_are_counted_as_the_eigenvalues_outside_the_circle(seed):
    rng, n = np.random.default_rng(seed), 4
    edges = [(i, i + 1) for i in range(n - 1)] + ([(0, n - 1)] if seed % 2 else [])
    team, control = network_of_edges(edges, np.eye(n)[seed % n]), Control(alpha_r=rng.uniform(0.5, 8.0))
    counts = []
    for delay in (0, 2, 5, 11, 18):
        tick = float(rng.uniform(0.02, 0.2))
        modes = np.abs(np.linalg.eigvals(delayed_map(team, control, tick, delay)))
        counts.append(int(np.sum(modes > 1.0 + 1e-5)))
        assert growing_modes(team, control, tick, delay) == counts[-1]
    assert max(counts) > 0


@pytest.mark.parametrize("delay", [0, 3])
def test_the_delayed_map_is_what_the_team_does(delay):
    team = network_of_edges([(0, 1), (1, 2), (1, 3)], np.array([0.0, 1.0, 0.0, 0.0]))
    control, rng = Control(alpha_r=2.0, leak=0.1), np.random.default_rng(3)
    if delay == 0:
        np.testing.assert_allclose(delayed_map(team, control, 0.01, 0), sampled_map(team, control, 0.01), atol=1e-15)
    late = exchange_of(f"{KEYS}delay_ticks=3")
    channel = dataclasses.replace(late.channel, delay=np.full(6, delay))
    one, m = Exchange(team, channel), np.zeros((4, 2))
    memory = one.empty()
    past = rng.normal(size=(delay, 4, 4))  # what was under way before
    for state in past:
        memory = one.transmitted(state[:, :2], state[:, 2:], memory)
    p, xi = rng.normal(size=(2, 4, 2))
    stack = [np.concatenate([p[:, 0], xi[:, 0]]), *(np.concatenate([s[:, 0], s[:, 2]]) for s in past[::-1])]
    x = np.concatenate(stack)
    for _ in range(20):
        memory = one.transmitted(p, xi, memory)
        u, rate = one.rates(control, (p, xi), m, memory)
        p, xi = p + 0.01 * u, xi + 0.01 * rate
        x = delayed_map(team, control, 0.01, delay) @ x
        np.testing.assert_allclose(x[:8], np.concatenate([p[:, 0], xi[:, 0]]), atol=1e-12)


@pytest.mark.slow
def test_a_team_is_stable_up_to_its_margin_and_the_run_says_so():
    scenario = scenario_of("control.alpha_r=1.0")
    margin = delay_margin(network(scenario), scenario.control, scenario.timing.tick, 79)
    assert margin is not None and 1 <= margin < 79
    spreads = {}
    for delay in (margin, margin + 8):
        keys = (f"{KEYS}delay_ticks={delay}", "timing.duration=60", "control.alpha_r=1.0")
        run = Simulation.build(scenario_of(*keys))
        p = np.array([tick.problem.p for tick in run.control_ticks()])
        spreads[delay] = [
            np.abs(p[a:b] - p[a:b].mean(axis=1, keepdims=True)).max() for a, b in ((2000, 3000), (5000, 6000))
        ]
    near, far = spreads.values()
    assert near[1] < near[0]
    assert far[1] > 2.0 * far[0]
    warnings = stability_warnings(scenario_of(f"{KEYS}delay_ticks={margin + 8}", "control.alpha_r=1.0"))
    assert len(warnings) == 1 and f"stable up to {margin} ticks" in warnings[0]
    assert stability_warnings(scenario_of(f"{KEYS}delay_ticks={margin}", "control.alpha_r=1.0")) == []


def test_a_certificate_does_not_know_of_the_delay_and_the_run_says_so():
    certified = load_scenario("paper/simulation_near", ["governor.kind=certified", f"{KEYS}delay_ticks=2"]).scenario
    assert "guarantees nothing here" in stability_warnings(certified)[0]


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("delay_ticks=1001", "is 1001 ticks; allowed: 0 to 1000"),
        ("jitter_ticks=1001", "is 1001 ticks; allowed: 0 to 1000"),
        ("outages=[{robot: 9, time: 1.0}]", "network.pre_stabiliser.outages"),
    ],
)
def test_what_cannot_be_is_refused(key, says):
    with pytest.raises(InputError, match=says):
        scenario_of(KEYS + key)
    with pytest.raises(InputError, match=r"at most 0.6667 in runs of loss_burst, 2 ticks"):
        scenario_of(f"{KEYS}loss=0.7", f"{KEYS}loss_burst=2")


def test_worlds_side_by_side_exchange_at_once():
    scenario = load_scenario("paper/experiment_near", [f"{KEYS}loss=0.1"]).scenario
    with pytest.raises(InputError, match="one by one"):
        BatchSimulation(scenario, (1, 2))
