"""The equilibrium in closed form, and the passivity balance of the paper's proof as it really is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver
from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.governor.monitor.equilibrium import equilibrium
from pbrg_mj.governor.monitor.passivity import flow_passivity, passivity
from pbrg_mj.governor.monitor.passivity_blocks import (
    flow_passivities_of_block,
    passivities_about_optima,
    rounds_of_block,
)
from pbrg_mj.governor.monitor.passivity_monitor import passivity_monitor
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.rows import rho, row_values
from tests.channels import channel
from tests.problems import FORMATION, GRAPHS, graph, half_spaces, problem, random_problem

FIELDS = Estimates._fields
STEP = 1e-3


def planted(rng, network):
    """A problem and its optimum, drawn the other way round: m*, lambda* and the state first, then r and h."""
    m, p, xi = rng.normal(size=2), rng.normal(size=(5, 2)), 0.3 * rng.normal(size=(5, 2))
    spaces = half_spaces([(int(rng.integers(5)), rng.normal(size=2), 0.0) for _ in range(3)])
    lam = np.zeros((5, 15))
    for i, k in np.argwhere(spaces.active):
        support = FORMATION @ spaces.G[i, k]
        binding = rng.random() < 0.5
        lam[i, 5 * k + int(np.argmax(support))] = rng.uniform(0.1, 2.0) if binding else 0.0
        slack = 0.0 if binding else rng.uniform(0.1, 1.0)
        spaces.h[i, k] = rho(m, p, xi) + spaces.G[i, k] @ m + support.max() + slack
    rows = ball_rows(spaces, FORMATION)
    gradient = (5 * m - p.sum(axis=0)) / rho(m, p, xi) * lam.sum() + np.einsum("ir,irc->c", lam, rows.C)
    leaders = network.leader.sum()
    static = dataclasses.replace(problem([], p, m + gradient / (2 * leaders), network, xi), rows=rows)
    return static, Optimum(m, "solved", 0.0, lam, "planted", 0.0, 0.0)


def change(static, estimates, flow):
    after = run_rounds(static, estimates, flow, 1)
    return Estimates(*((getattr(after, name) - getattr(estimates, name)) / flow.step for name in FIELDS))


def test_a_thousand_planted_optima_are_fixed_points_of_the_rounds():
    rng = np.random.default_rng(8)
    networks = [graph(edges, leaders) for edges in GRAPHS.values() for leaders in ((4,), (0, 3))]
    for k in range(1000):
        static, optimum = planted(rng, networks[k % len(networks)])
        alpha = rng.uniform(0.5, 8.0)
        still = change(static, equilibrium(static, optimum, alpha, np.zeros(22)), Flow(alpha, STEP))
        for name in ("z", "zeta", "nu"):
            np.testing.assert_allclose(getattr(still, name), 0.0, atol=1e-10)
        np.testing.assert_allclose(still.lam[static.rows.active], 0.0, atol=1e-10)  # g = 0 where lambda > 0


@pytest.mark.parametrize("kind", [ClarabelSolver, CvxpySolver])
def test_the_centralized_solvers_find_the_planted_optima(kind):
    """All thousand, the 115 with three binding rows and thus without an interior among them."""
    rng = np.random.default_rng(8)
    solver, degenerate = kind(), 0
    for _ in range(1000):
        static, optimum = planted(rng, graph())
        degenerate += np.count_nonzero(optimum.multipliers) == 3
        got = solver.solve(static)
        assert got.status == "solved"
        np.testing.assert_allclose(got.m, optimum.m, atol=3e-5)
        assert got.cost == pytest.approx(np.sum((static.reference - optimum.m) ** 2), rel=1e-6, abs=1e-9)
        assert row_values(static.rows, got.m, static.p, static.xi).max() <= 1e-8
    assert degenerate == 115


@pytest.mark.parametrize("name", GRAPHS)
def test_both_subsystems_are_passive_and_their_balance_is_the_proofs(name):
    """At arbitrary estimates: the primal dissipation equals its closed form, both are never negative."""
    rng = np.random.default_rng(5)
    network, flow = graph(GRAPHS[name]), Flow(2.0, STEP)
    for _ in range(200):
        static, optimum = planted(rng, network)
        lam = rng.uniform(0.2, 1.0, size=(5, 15)) * static.rows.active
        estimates = Estimates(rng.normal(size=(5, 22)), rng.normal(size=(5, 22)), lam, rng.normal(size=(5, 4)))
        balance = passivity(static, optimum, flow.alpha, estimates, change(static, estimates, flow))
        off = estimates.z - equilibrium(static, optimum, flow.alpha, np.zeros(22)).z
        consensus = np.sum(off * (network.laplacian @ off))
        descent = flow.alpha * np.sum(2.0 * network.leader[:, None] * off[:, :2] ** 2)
        assert balance.primal_dissipation == pytest.approx(consensus + descent, rel=1e-7)
        assert balance.dual_dissipation >= -1e-9


def test_the_total_storage_falls_along_a_static_run():
    rng = np.random.default_rng(6)
    static = random_problem(rng)
    optimum = ClarabelSolver().solve(static)
    while optimum.status != "solved":
        static = random_problem(rng)
        optimum = ClarabelSolver().solve(static)
    flow = Flow(2.0, STEP)
    estimates = DistributedGovernor(flow, 1, "zero").init(static).estimates
    totals = []
    for _ in range(200):
        balance = passivity(static, optimum, flow.alpha, estimates, change(static, estimates, flow))
        totals.append(balance.primal_storage + flow.alpha * balance.dual_storage)
        estimates = run_rounds(static, estimates, flow, 100)
    assert np.all(np.diff(totals) <= 1e-4 * totals[0])  # explicit steps add a little: O(step)
    assert totals[-1] < 0.2 * totals[0]


def test_a_wrong_update_shows_in_the_sign():
    """The same estimates with consensus run backwards: dissipation turns negative."""
    rng = np.random.default_rng(9)
    static, optimum = planted(rng, graph())
    flow = Flow(2.0, STEP)
    estimates = Estimates(rng.normal(size=(5, 22)), np.zeros((5, 22)), np.zeros((5, 15)), np.zeros((5, 4)))
    rates = change(static, estimates, flow)
    backwards = rates._replace(z=rates.z + 2 * static.network.laplacian @ estimates.z)
    assert passivity(static, optimum, flow.alpha, estimates, rates).primal_dissipation > 0
    assert passivity(static, optimum, flow.alpha, estimates, backwards).primal_dissipation < 0


def three_rounds(static, estimates, flow):
    return (estimates, run_rounds(static, estimates, flow, 1), run_rounds(static, estimates, flow, 2))


def random_estimates(rng, rows):
    lam = rng.uniform(0.2, 1.0, size=(5, 15)) * rows.active
    return Estimates(rng.normal(size=(5, 22)), rng.normal(size=(5, 22)), lam, rng.normal(size=(5, 4)))


@pytest.mark.parametrize("name", GRAPHS)
def test_the_flows_own_velocity_dissipates_what_consensus_and_descent_take(name):
    """In closed form, feasible or not: nothing about an optimum is needed."""
    rng = np.random.default_rng(15)
    network, flow = graph(GRAPHS[name]), Flow(2.0, STEP)
    for _ in range(100):
        static = random_problem(rng, network)
        first, second, third = three_rounds(static, random_estimates(rng, static.rows), flow)
        balance = flow_passivity(static, flow, (first, second, third))
        velocity = (second.z - first.z) / STEP
        taken = np.sum(velocity * (network.laplacian @ velocity))
        taken += flow.alpha * np.sum(2.0 * network.leader[:, None] * velocity[:, :2] ** 2)
        assert balance.primal_dissipation == pytest.approx(taken, rel=1e-7)
        assert balance.dual_dissipation >= -1e-9 * balance.dual_storage / STEP
        assert balance.primal_storage == pytest.approx(
            0.5 * np.sum(velocity**2) + 0.5 * np.sum((second.zeta - first.zeta) ** 2) / STEP**2
        )


def smallest_ball(z):
    """The least rho in any robot's estimate."""
    off = z[:, 2:12].reshape(5, 5, 2) - z[:, None, :2]
    return np.sqrt(np.sum(off**2, axis=(1, 2)) + np.sum(z[:, 12:] ** 2, axis=1)).min()


def test_the_flows_speed_falls_along_a_static_run_even_without_an_optimum():
    rng, flow, infeasible, lengths = np.random.default_rng(16), Flow(2.0, STEP, 5.0), 0, []
    for _ in range(12):
        static = random_problem(rng)
        infeasible += ClarabelSolver().solve(static).status == "infeasible"
        estimates, speeds = random_estimates(rng, static.rows), []
        for _ in range(100):
            balance = flow_passivity(static, flow, three_rounds(static, estimates, flow))
            speeds.append(balance.primal_storage + flow.alpha * balance.dual_storage)
            assert balance.primal_dissipation > 0
            assert balance.dual_dissipation >= -1e-9
            estimates = run_rounds(static, estimates, flow, 100)
            if smallest_ball(estimates.z) < 0.1:  # at the kink of rho explicit rounds chatter
                break
        assert np.all(np.diff(speeds) < 0)
        lengths.append(len(speeds))
    assert 3 <= infeasible <= 10
    assert sum(lengths) > 600


def test_a_delayed_plain_exchange_shows_in_the_sign():
    """0.1 s is well borne, 0.4 s is where it diverges (docs/network.md)."""
    static = random_problem(np.random.default_rng(7))
    for delay, least, most in ((20, 0.0, 0.0), (80, 0.3, 0.6)):
        late = channel(static.network, delay)
        governor = DistributedGovernor(Flow(2.0, 5e-3), 10, "start", late)
        memory, negative = governor.init(static), []
        for _ in range(600):
            _, memory = governor.step(static, memory)
            (balance,) = passivity_monitor(governor).of_velocity(TickBlock.of([static]), [memory])
            negative.append(balance.primal_dissipation < 0)
        assert least <= np.mean(negative) <= most


def test_blocks_of_two_rounds_are_two_rounds():
    rng, flow = np.random.default_rng(17), Flow(2.0, STEP, 0.8)
    problems = [random_problem(rng) for _ in range(20)]
    states = [random_estimates(rng, static.rows) for static in problems]
    block = TickBlock.of(problems)
    want = [flow_passivity(one, flow, three_rounds(one, at, flow)) for one, at in zip(problems, states, strict=True)]
    assert flow_passivities_of_block(block, flow, rounds_of_block(block, flow, states)) == want
    states[3].z[2, 3] = np.inf
    found = flow_passivities_of_block(block, flow, rounds_of_block(block, flow, states))
    assert np.isnan(found.pop(3).primal_storage)
    assert found == want[:3] + want[4:]


def test_blocks_of_one_round_are_the_round_and_its_balance():
    rng, flow = np.random.default_rng(18), Flow(2.0, STEP, 0.8)
    problems, optima = zip(*[planted(rng, graph(leaders=(0, 3))) for _ in range(20)], strict=True)
    states = [random_estimates(rng, static.rows) for static in problems]
    block, want = TickBlock.of(problems), []
    for static, optimum, at in zip(problems, optima, states, strict=True):
        want.append(passivity(static, optimum, flow.alpha, at, change(static, at, flow)))
    rounds = rounds_of_block(block, flow, states)
    assert passivities_about_optima(block, optima, flow, rounds, 100.0) == want
    reached = [np.abs(run_rounds(*one, flow, 1).z).max() for one in zip(problems, states, strict=True)]
    assert passivities_about_optima(block, optima, flow, rounds, max(reached)) == want
    beyond = passivities_about_optima(block, optima, flow, rounds, np.nextafter(max(reached), 0.0))
    assert [np.isnan(one.primal_storage) for one in beyond] == [one == max(reached) for one in reached]


def test_nothing_is_known_about_no_optimum_nor_of_a_flow_past_all_bounds():
    static, optimum = planted(np.random.default_rng(19), graph())
    nothing = optimum._replace(m=np.full(2, np.nan), multipliers=np.full((5, 15), np.nan))
    governor = DistributedGovernor(Flow(2.0, STEP), 10, "start", diverged_beyond=50.0)
    memory = governor.init(static)
    block, past = TickBlock.of([static, static]), memory._replace(diverged=True)
    known, unknown = passivity_monitor(governor).about_optima(block, [memory, memory], [optimum, nothing])
    assert np.isfinite(known.primal_storage)
    assert np.isnan(unknown).all()
    for known, unknown in (
        passivity_monitor(governor).about_optima(block, [memory, past], [optimum, optimum]),
        passivity_monitor(governor).of_velocity(block, [memory, past]),
    ):
        assert np.isfinite(known.primal_storage)
        assert np.isnan(unknown).all()
