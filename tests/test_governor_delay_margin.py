"""The delay margin of the plain exchange: against all eigenvalues, and against rounds that really converge or grow."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.stability.delay_margin import DelayedRounds, delay_margin
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms
from tests.channels import channel, links, uneven
from tests.problems import FORMATION, GRAPHS, START, graph, problem


def eigenvalues(rounds, lead, robot, gradient):
    """All modes of the rounds, every message on its way a state of its own."""
    network, s, n = rounds.network, rounds.step, rounds.network.robots
    size = 2 * n + 1
    A = np.zeros((size * (int(rounds.delay.max()) + 1),) * 2)
    A[:size, :size] = np.eye(size)
    for i in range(n):
        A[i, i] -= s * (network.degree[i] + lead * network.leader[i])
        A[i, n + i] += s * network.degree[i]
        A[n + i, i] -= s * network.degree[i]
    for (i, k), delay in zip(links(network), rounds.delay.tolist(), strict=True):
        A[i, size * delay + k] += s
        A[i, size * delay + n + k] -= s
        A[n + i, size * delay + k] += s
    A[robot, 2 * n] = -s * rounds.alpha * gradient
    A[2 * n, robot] = s * gradient
    A[size:, :-size] = np.eye(len(A) - size)
    return np.abs(np.linalg.eigvals(A))


def largest(rounds, gradients):
    """The largest growth of any mode, from all eigenvalues; the conserved mean of zeta, 1, aside."""
    robots = range(rounds.network.robots)
    sizes = [eigenvalues(rounds, 0.0, robot, 1.0) for robot in robots]
    sizes += [eigenvalues(rounds, 2 * rounds.alpha, robot, gradients[robot]) for robot in robots]
    return max(size[np.abs(size - 1) > 1e-9].max() for size in sizes)


@pytest.mark.parametrize("delay", [lambda i, k: 100, lambda i, k: 30 * uneven(i, k)])
@pytest.mark.parametrize("name", ["ring", "path", "kite"])
def test_the_margin_is_where_the_first_eigenvalue_leaves_the_circle(name, delay):
    network, alpha = graph(GRAPHS[name]), 2.0
    gradients = np.array([2.0, 2.0, 1.0, 2.0, 2.0])
    step = 0.4 * linear_step_limit(network, alpha, gradients)
    rounds = DelayedRounds(network, alpha, step, channel(network, delay).delay)
    margin = delay_margin(rounds, gradients)
    assert margin is not None
    assert 1 < margin < rounds.delay.max()
    assert largest(rounds.scaled(margin), gradients) < 1.0
    assert largest(rounds.scaled(margin + 1), gradients) > 1.0
    assert delay_margin(rounds.scaled(margin), gradients) is None


STEP = 4e-3  # [s]
WALLS = [(4, [1, 1], 3.0), (0, [0, 1], 2.2), (3, [1, 0.2], 2.5)]


def grows(name, alpha, delay, walls):
    """Whether rounds of a static problem leave all bounds."""
    static = problem(walls, 0.3 * (START - FORMATION), [2.0, 3.0], graph(GRAPHS[name]))
    links_ = channel(static.network, delay)
    governor = DistributedGovernor(Flow(alpha, STEP), round(200 / STEP), "start", links_)
    solution, _ = governor.step(static, governor.init(static))
    return not np.isfinite(solution.m).all() or np.abs(solution.m).max() > 100


@pytest.mark.parametrize("alpha", [2.0, 7.0])
@pytest.mark.parametrize("name", ["ring", "path"])
def test_rounds_hold_at_the_margin_and_fall_apart_not_far_beyond(name, alpha):
    network = graph(GRAPHS[name])
    rounds = DelayedRounds(network, alpha, STEP, np.full(len(network.neighbours), 400))
    margin = delay_margin(rounds, max_gradient_norms(network, FORMATION, None))
    assert margin is not None
    for walls in ([], WALLS):
        assert not grows(name, alpha, margin, walls)
    assert grows(name, alpha, round(1.6 * margin), [])


def test_the_papers_ring_bears_four_tenths_of_a_second_whatever_the_step():
    network = graph()
    for step in (1e-3, 5e-3):
        rounds = DelayedRounds(network, 2.0, step, np.full(10, round(0.8 / step)))
        margin = delay_margin(rounds, max_gradient_norms(network, FORMATION, None))
        assert margin is not None
        assert margin * step == pytest.approx(0.39, abs=0.0055)


def test_too_long_a_step_has_no_margin_at_all():
    network, gradients = graph(), max_gradient_norms(graph(), FORMATION, None)
    allowed = linear_step_limit(network, 7.0, gradients)
    nothing_late = np.zeros(10, dtype=np.int64)
    assert delay_margin(DelayedRounds(network, 7.0, 0.999 * allowed, nothing_late), gradients) is None
    assert delay_margin(DelayedRounds(network, 7.0, 1.001 * allowed, nothing_late), gradients) == -1
