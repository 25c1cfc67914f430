"""Compiled kernels against the equations in plain NumPy: random graphs, rows, states, delays, losses and outages."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed import equations, network_equations, network_rounds, rounds
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.link_states import LinkStates
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema.governor import Control
from pbrg_mj.team.channel import Loss
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from tests.channels import channel

NETWORKS = {
    "delay": "{delay_rounds: 7}",
    "loss": "{loss: 0.2, loss_burst: 3}",
    "waves": "{exchange: scattering, delay_rounds: 4, loss: 0.1}",
    "jitter": "{delay_rounds: 1, jitter_rounds: 4}",
    "a queue": "{jitter_rounds: 9, reordering: false}",
    "waves out of order": "{exchange: scattering, delay_rounds: 2, jitter_rounds: 6, loss: 0.4, loss_burst: 5}",
    "silence": "{silences: [{robot: 2, time: 0.1, duration: 0.6}], silent_after: 0.2}",
}


def close(got, want):
    """Equal but for rounding: 1e-12 of the array's size."""
    np.testing.assert_allclose(got, want, rtol=0, atol=1e-12 * max(1.0, np.abs(want).max(initial=0.0)))


def random_network(rng):
    """One to nine robots, in one piece or not, with any number of leaders."""
    n = int(rng.integers(1, 10))
    edges = [(i, k) for i in range(n) for k in range(i) if rng.random() < rng.uniform(0.2, 1.0)]
    return network_of_edges(edges, (rng.random(n) < 0.4).astype(float))


def random_team(rng, network):
    """A problem with rows of any size, one robot at the kink of rho, and estimates."""
    n, slots = network.robots, int(rng.integers(1, 9))
    scale = 10.0 ** rng.integers(-1, 3)
    rows = Rows(
        rng.uniform(0, 2, (n, slots)),
        rng.normal(size=(n, slots, 2)),
        scale * rng.normal(size=(n, slots)),
        rng.random((n, slots)) < rng.uniform(0, 1),
    )
    z = scale * rng.normal(size=(n, 4 * n + 2))
    z[0] = np.concatenate([np.tile(z[0, :2], n + 1), np.zeros(2 * n)])
    lam = rng.uniform(0, 1, rows.d.shape) * (rng.random(rows.d.shape) < 0.5) * rows.active
    p, xi = scale * rng.normal(size=(2, n, 2))
    problem = Problem(network, p, xi, rows, scale * rng.normal(size=2))
    return problem, Estimates(z, scale * rng.normal(size=z.shape), lam, rng.normal(size=(n, 4)))


def random_flow(rng):
    return Flow(rng.uniform(0.5, 5.0), 10.0 ** rng.uniform(-4, -1), rng.choice([0.9, np.inf]))


@pytest.mark.parametrize("seed", range(30))
def test_a_compiled_round_is_the_round_of_the_equations(seed):
    rng = np.random.default_rng(seed)
    problem, estimates = random_team(rng, random_network(rng))
    flow = random_flow(rng)
    for got, want in zip(
        rounds.run_rounds(problem, estimates, flow, 1), equations.run_rounds(problem, estimates, flow, 1), strict=True
    ):
        close(got, want)


@pytest.mark.parametrize("seed", range(30))
def test_a_compiled_round_over_a_network_is_the_round_of_the_equations(seed):
    """Round after round from the compiled state: numbers to rounding; ages, counts and who is up exactly."""
    rng = np.random.default_rng(seed)
    network = random_network(rng)
    problem, estimates = random_team(rng, network)
    impedance = rng.uniform(0.3, 4.0) if seed % 2 else 0.0
    delay = {pair: int(rng.integers(seed % 2, 6)) for pair in np.ndindex(network.robots, network.robots)}
    silent = [(int(rng.integers(network.robots)), int(rng.integers(10)), int(rng.integers(10, 25))) for _ in range(2)]
    links = channel(
        network,
        lambda i, k: delay[i, k],
        impedance,
        (Loss(), Loss.independent(0.3), Loss.bursty(0.3, 4.0))[seed % 3],
        outage_rounds=silent,
        silent_after=int(rng.integers(2, 8)),
        jitter=int(rng.integers(0, 5)) if seed >= 12 else 0,
        in_order=seed >= 22,
        reserve=int(rng.integers(0, 4)),
    )
    memory, flow = (estimates, LinkStates.empty(links, network.robots)), random_flow(rng)
    for _ in range(30):
        *compiled, messages = network_rounds.run_network_rounds(problem, memory, links, flow, 1)
        *specified, sent = network_equations.run_network_rounds(problem, memory, links, flow, 1)
        np.testing.assert_array_equal(messages, sent)
        for got, want in zip(compiled[0], specified[0], strict=True):
            close(got, want)
        for field in dataclasses.fields(LinkStates):
            got, want = getattr(compiled[1], field.name), getattr(specified[1], field.name)
            close(got, want) if np.asarray(got).dtype == float else np.testing.assert_array_equal(got, want)
        memory = tuple(compiled)


@pytest.mark.parametrize("seed", range(20))
def test_the_compiled_pre_stabiliser_is_eq_2(seed):
    rng = np.random.default_rng(seed)
    network = random_network(rng)
    p, xi, m = rng.normal(size=(3, network.robots, 2))
    control = Control(alpha_r=rng.uniform(0.1, 5.0), leak=rng.uniform(0, 1))
    for got, want in zip(
        pre_stabilise(network, control, p, xi, m), pre_stabilise(network, control, p, xi, m, "numpy"), strict=True
    ):
        close(got, want)


def records(*overrides):
    scenario = load_scenario("paper/simulation_near", ["timing.duration=0.5", *overrides]).scenario
    return list(Simulation.build(scenario).records())


@pytest.mark.parametrize("network", ["{}", *NETWORKS.values()], ids=["in time", *NETWORKS])
def test_a_scenario_runs_on_the_equations(network):
    compiled = records(f"network={network}")
    specified = records(f"network={network}", "governor.backend=numpy")
    for one, other in zip(compiled, specified, strict=True):
        assert one.solution.status == other.solution.status
        np.testing.assert_array_equal(one.solution.bytes_sent, other.solution.bytes_sent)
        for name in ("m", "multipliers"):
            np.testing.assert_allclose(getattr(one.solution, name), getattr(other.solution, name), rtol=0, atol=1e-9)
        for name in ("velocity", "hand_world"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=1e-9)
        balances = [record.passivity or Passivity.unknown() for record in (one, other)]
        np.testing.assert_allclose(*balances, rtol=1e-6, atol=1e-6)
    assert any(not np.array_equal(a.solution.m, b.solution.m) for a, b in zip(compiled, specified, strict=True))
