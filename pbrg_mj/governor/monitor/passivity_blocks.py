"""Passivity balances of blocks of ticks, when every message arrives within its round."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import (
    ReceivedStates,
    check_limits,
    empty_estimates,
    private_data,
    update_robots,
)
from pbrg_mj.governor.monitor.passivity import Passivity, balance_about_optimum, flow_balance
from pbrg_mj.governor.monitor.tick_block import BlockArrays, TickBlock, problem_at, stack_ticks
from pbrg_mj.kernel import kernel
from pbrg_mj.team.network import GraphArrays


def passivities_about_optima(
    block: TickBlock, optima: Sequence[Optimum], flow: Flow, estimates: Sequence[Estimates], limit: float
) -> list[Passivity]:
    """Return `passivity` of T states and the rounds that follow them when every message arrives within its round.

    Unknown where such a round leaves `limit` [m] or is not finite, and where there is no optimum.
    """
    balances, gains, net = np.empty((len(optima), 4)), tuple(flow), block.network
    m, lam = stack_ticks([one.m for one in optima]), stack_ticks([one.multipliers for one in optima])
    states = tuple(map(stack_ticks, zip(*estimates, strict=True)))
    _one_round_balances(states, net.arrays, block.arrays, gains, m, lam, net.laplacian_pinv, limit, balances)
    return Passivity.from_rows(balances)


def flow_passivities_of_block(block: TickBlock, flow: Flow, estimates: Sequence[Estimates]) -> list[Passivity]:
    """Return `flow_passivity` of T states and the two rounds that follow each when messages arrive within theirs."""
    balances, states = np.empty((len(estimates), 4)), tuple(map(stack_ticks, zip(*estimates, strict=True)))
    _two_rounds_balances(states, block.network.arrays, block.arrays, tuple(flow), balances)
    return Passivity.from_rows(balances)


@kernel
def _one_round_balances(states, graph, block_arrays, flow, m, lam, pinv, limit, balances):
    """Write a row of `balances` (T, 4) for every tick, NaN where the round leaves `limit`.

    `states` are z, zeta, lam, nu of `Estimates` with T as their first axis, `graph` the members of `GraphArrays`,
    `block_arrays` of `BlockArrays`, `flow` of `Flow`; `m` (T, 2) and `lam` (T, n, R) the optima, `pinv` (n, n).
    """
    block, gains, net = BlockArrays(*block_arrays), Flow(*flow), GraphArrays(*graph)
    for t in range(len(m)):
        problem, now = problem_at(block, t), _estimates_at(states, t)
        private = private_data(graph, (problem.p, problem.xi, problem.reference), problem.rows)
        rate = _next_round(now, net, private, gains)
        if check_limits(rate.z, rate.lam, limit, gains.multiplier_cap)[0]:
            _to_rate(rate.z, now.z, gains.step)
            _to_rate(rate.zeta, now.zeta, gains.step)
            _to_rate(rate.lam, now.lam, gains.step)
            _to_rate(rate.nu, now.nu, gains.step)
            states_there, rows = (m[t], problem.p, problem.xi), problem.rows
            about = (
                *states_there,
                lam[t],
                rows.a,
                rows.C,
                rows.along,
                net.leader,
                problem.reference,
                pinv,
                gains.alpha,
            )
            _write_balance(balance_about_optimum(about, now, rate), balances, t)
        else:
            _write_balance((np.nan, np.nan, np.nan, np.nan), balances, t)


@kernel
def _two_rounds_balances(states, graph, block_arrays, flow, balances):
    """Write a row of `balances` (T, 4) for every tick; arguments as of `_one_round_balances`."""
    block, gains, net = BlockArrays(*block_arrays), Flow(*flow), GraphArrays(*graph)
    for t in range(len(balances)):
        problem, now = problem_at(block, t), _estimates_at(states, t)
        private = private_data(graph, (problem.p, problem.xi, problem.reference), problem.rows)
        first = _next_round(now, net, private, gains)
        second = _next_round(first, net, private, gains)
        rows = (problem.rows.a, problem.rows.C, problem.rows.along)
        balance = flow_balance(now, first, second, rows, gains.alpha, gains.step)
        _write_balance(balance, balances, t)


@kernel
def _estimates_at(states, t):
    z, zeta, lam, nu = states
    return Estimates(z[t], zeta[t], lam[t], nu[t])


@kernel
def _next_round(now, graph, private, flow):
    """Return the estimates a round later when every message arrives within it, arrays of their own."""
    new = Estimates(*empty_estimates(now))
    update_robots(now, new, ReceivedStates(graph.first, graph.neighbours, now.z, now.zeta), private, flow)
    return new


@kernel
def _to_rate(after, before, step):
    """Turn an array a round later into the rate of its change."""
    for i in range(after.shape[0]):
        for c in range(after.shape[1]):
            after[i, c] = (after[i, c] - before[i, c]) / step


@kernel
def _write_balance(balance, balances, t):
    balances[t, 0], balances[t, 1], balances[t, 2], balances[t, 3] = balance
