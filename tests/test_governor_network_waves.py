"""The scattering exchange: the same optimum at delays where plain exchange falls apart, and the energy it conserves."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.monitor.equilibrium import equilibrium
from pbrg_mj.team.channel import Loss
from tests.channels import M, channel, links, quiet, run
from tests.problems import GRAPHS, graph, problem
from tests.test_governor_static import WALLS, XI, P

STEP = 5e-3
SECOND = 200  # rounds
ETA = 2.0


def spread_out(i, k):
    """Delays of 0.1 to 1.1 s, different from link to link."""
    return 20 + 40 * ((3 * i + k) % 6)


def static(name="ring", walls=1):
    return problem(WALLS[walls], P, [2.0, 3.0], graph(GRAPHS[name]), XI)


def after(problem, links_, seconds):
    governor = DistributedGovernor(Flow(2.0, STEP), seconds * SECOND, "start", links_)
    return governor.step(problem, governor.init(problem))[0]


CASES = [(name, delay) for name in GRAPHS for delay in (100, spread_out)] + [("ring", delay) for delay in (1, 20, 300)]


@pytest.mark.parametrize(("name", "delay"), CASES)
def test_waves_reach_the_optimum_whatever_the_delay(name, delay):
    frozen = static(name)
    optimum = ClarabelSolver().solve(frozen).m
    assert np.linalg.norm(optimum - frozen.reference) > 0.5
    solution = after(frozen, channel(frozen.network, delay, ETA), 600)
    np.testing.assert_allclose(solution.m, np.tile(optimum, (5, 1)), atol=1e-4)


def test_waves_share_several_robots_walls():
    frozen = static(walls=3)
    optimum = ClarabelSolver().solve(frozen).m
    solution = after(frozen, channel(frozen.network, spread_out, ETA), 600)
    np.testing.assert_allclose(solution.m, np.tile(optimum, (5, 1)), atol=1e-4)


@pytest.mark.parametrize("delay", [80, 120, 300])
def test_plain_exchange_falls_apart_at_such_delays(delay):
    """0.4 s and more on the paper's ring; at 0.3 s it still converges."""
    frozen = static()
    optimum = ClarabelSolver().solve(frozen).m
    assert np.abs(after(frozen, channel(frozen.network, delay), 300).m - optimum).max() > 10.0
    good = after(frozen, channel(frozen.network, 60), 300).m
    np.testing.assert_allclose(good, np.tile(optimum, (5, 1)), atol=1e-3)


@pytest.mark.parametrize("impedance", [0.0, ETA])
def test_lost_messages_cost_time_and_not_the_optimum(impedance):
    frozen = static()
    optimum = ClarabelSolver().solve(frozen).m
    links_ = channel(frozen.network, 20, impedance, Loss.bursty(0.3, 20.0))
    np.testing.assert_allclose(after(frozen, links_, 300).m, np.tile(optimum, (5, 1)), atol=1e-3)


def energies(frozen, delay, rounds):
    """Storage of robots, multipliers and lines about the equilibrium, round by round."""
    flow, links_ = Flow(2.0, STEP), channel(frozen.network, delay, ETA)
    best = equilibrium(frozen, ClarabelSolver().solve(frozen), flow.alpha, np.zeros(22))
    y = np.stack([best.z, best.zeta], axis=1)
    # in equilibrium r = (y_i + y_k) / 2 and phi = M (y_k - y_i) at the sender k's end of the link to i
    ends = links(frozen.network)
    waves = np.stack([ETA * (y[i] + y[k]) / 2 + M @ (y[k] - y[i]) for i, k in ends], axis=1) / np.sqrt(2 * ETA)
    memory = quiet(links_, DistributedGovernor(flow, 1, "zero", links_).init(frozen).estimates)
    memory = run(frozen, memory, links_, flow, int(links_.delay.max()) + 1)  # every line is there
    totals = []
    for _ in range(rounds):
        estimates, exchange = memory
        off = {name: getattr(estimates, name) - getattr(best, name) for name in ("z", "zeta", "lam", "nu")}
        line = 0.0
        for e, delay_e in enumerate(links_.delay):
            slots = [(exchange.round - 1 - s) % exchange.flight.shape[2] for s in range(delay_e, -1, -1)]
            sent = np.diff(exchange.flight[:, e, slots], axis=1)  # messages carry sums
            line += 0.5 * STEP * np.sum((sent - waves[:, e, None]) ** 2)
        primal = 0.5 * (np.sum(off["z"] ** 2) + np.sum(off["zeta"] ** 2))
        totals.append(primal + line + flow.alpha * 0.5 * (np.sum(off["lam"] ** 2) + np.sum(off["nu"] ** 2)))
        memory = run(frozen, memory, links_, flow, 1)
    return np.array(totals)


@pytest.mark.parametrize("delay", [40, 200, spread_out])
def test_the_energy_of_robots_multipliers_and_lines_only_falls(delay):
    """The explicit step adds half of ||change||^2 a round; it must not show beside what the lines' ends dissipate."""
    totals = energies(static(), delay, 800)
    gained = np.maximum(np.diff(totals), 0.0).sum()
    assert totals[-1] < 0.7 * totals[0]
    assert gained < 1e-3 * totals[0]
