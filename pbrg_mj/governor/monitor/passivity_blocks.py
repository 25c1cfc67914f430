"""Passivity balances of blocks of ticks, when every message arrives within its round."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.rounds import (
    Estimates,
    Flow,
    active_rows,
    check_limits,
    empty_estimates,
    update_robots,
)
from pbrg_mj.governor.monitor.passivity import Passivity, balance_about_optimum, flow_balance
from pbrg_mj.governor.monitor.tick_block import TickBlock, problem_at, stack_ticks
from pbrg_mj.kernel import kernel


def passivities_about_optima(
    block: TickBlock, optima: Sequence[Optimum], flow: Flow, estimates: Sequence[Estimates], limit: float
) -> list[Passivity]:
    """Return `passivity` of T states and the rounds that follow them when every message arrives within its round.

    Unknown where such a round leaves `limit` [m] or is not finite, and where there is no optimum.
    """
    m, lam = stack_ticks([one.m for one in optima]), stack_ticks([one.multipliers for one in optima])
    balances = np.empty((len(optima), 4))
    optimum, gains = (m, lam, block.network.laplacian_pinv), (flow.alpha, flow.step, flow.multiplier_cap)
    _one_round_balances(_states(estimates), _graph(block), block.arrays, gains, optimum, limit, balances)
    return Passivity.from_rows(balances)


def _states(estimates: Sequence[Estimates]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return (
        stack_ticks([one.z for one in estimates]),
        stack_ticks([one.zeta for one in estimates]),
        stack_ticks([one.lam for one in estimates]),
        stack_ticks([one.nu for one in estimates]),
    )


def _graph(block: TickBlock) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    net = block.network
    return net.first, net.neighbours, net.leader


@kernel
def _one_round_balances(states, network, problems, gains, optimum, limit, balances):  # pragma: no cover - compiled
    m, lam, pinv = optimum
    for t in range(len(m)):
        state, rows = problem_at(problems, t)
        optimum = (m[t], lam[t], pinv)
        _write_balance(
            _one_round_balance(_state_at(states, t), network, state, rows, gains, optimum, limit), balances, t
        )


@kernel
def _state_at(states, t):  # pragma: no cover - compiled
    z, zeta, lam, nu = states
    return z[t], zeta[t], lam[t], nu[t]


@kernel
def _write_balance(balance, balances, t):  # pragma: no cover - compiled
    balances[t, 0], balances[t, 1], balances[t, 2], balances[t, 3] = balance


@kernel
def _one_round_balance(estimates, network, state, rows, gains, optimum, limit):  # pragma: no cover - compiled
    leader, (p, xi, r), (a, C, _, active), (m, lam, pinv) = network[2], state, rows, optimum
    after = _next_round(estimates, network, (leader, state, rows, active_rows(active)), gains)
    if not check_limits(after[0], after[2], limit, gains[2])[0]:
        return np.nan, np.nan, np.nan, np.nan
    _to_rate(after[0], estimates[0], gains[1])
    _to_rate(after[1], estimates[1], gains[1])
    _to_rate(after[2], estimates[2], gains[1])
    _to_rate(after[3], estimates[3], gains[1])
    return balance_about_optimum(((m, p, xi), lam, (a, C), (leader, r), pinv, gains[0]), estimates, after)


@kernel
def _next_round(estimates, network, own, gains):  # pragma: no cover - compiled
    """Return the estimates a round later when every message arrives within it, arrays of their own."""
    new = empty_estimates(estimates)
    update_robots(estimates, new, (network[0], network[1], estimates[0], estimates[1]), own, gains)
    return new


@kernel
def _to_rate(after, before, step):  # pragma: no cover - compiled
    """Turn an array a round later into the rate of its change."""
    for i in range(after.shape[0]):
        for c in range(after.shape[1]):
            after[i, c] = (after[i, c] - before[i, c]) / step


def flow_passivities_of_block(block: TickBlock, flow: Flow, estimates: Sequence[Estimates]) -> list[Passivity]:
    """Return `flow_passivity` of T states and the two rounds that follow each when messages arrive within theirs."""
    balances, gains = np.empty((len(estimates), 4)), (flow.alpha, flow.step, flow.multiplier_cap)
    _two_rounds_balances(_states(estimates), _graph(block), block.arrays, gains, balances)
    return Passivity.from_rows(balances)


@kernel
def _two_rounds_balances(states, network, problems, gains, balances):  # pragma: no cover - compiled
    for t in range(len(balances)):
        state, rows = problem_at(problems, t)
        _write_balance(_two_rounds_balance(_state_at(states, t), network, state, rows, gains), balances, t)


@kernel
def _two_rounds_balance(estimates, network, state, rows, gains):  # pragma: no cover - compiled
    own = (network[2], state, rows, active_rows(rows[3]))
    first = _next_round(estimates, network, own, gains)
    second = _next_round(first, network, own, gains)
    return flow_balance((estimates, first, second), (rows[0], rows[1]), gains[0], gains[1])
