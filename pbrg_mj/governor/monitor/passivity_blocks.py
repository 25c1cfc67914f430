"""Passivity balances of blocks of ticks, when every message arrives within its round."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import (
    ReceivedStates,
    check_limits,
    private_data,
    update_robots,
)
from pbrg_mj.governor.monitor.passivity import Passivity, balance_about_optimum, flow_balance
from pbrg_mj.governor.monitor.tick_block import BlockArrays, TickBlock, problem_at, stack_ticks
from pbrg_mj.kernel import kernel
from pbrg_mj.team.network import GraphArrays


class BlockRounds(NamedTuple):
    """z, zeta, lam, nu of T ticks with T as their first axis, and those a round later; both balances need them."""

    now: tuple[np.ndarray, ...]
    after: tuple[np.ndarray, ...]


def rounds_of_block(block: TickBlock, flow: Flow, estimates: Sequence[Estimates]) -> BlockRounds:
    """Return T states and the rounds that follow them when every message arrives within its round."""
    now = tuple(map(stack_ticks, zip(*estimates, strict=True)))
    return BlockRounds(now, _next_rounds(now, block, flow))


def passivities_about_optima(
    block: TickBlock, optima: Sequence[Optimum], flow: Flow, rounds: BlockRounds, limit: float
) -> list[Passivity]:
    """Return `passivity` of T states and the rounds that follow them when every message arrives within its round.

    Unknown where such a round leaves `limit` [m] or is not finite, and where there is no optimum.
    """
    balances, gains, net = np.empty((len(optima), 4)), tuple(flow), block.network
    m, lam = stack_ticks([one.m for one in optima]), stack_ticks([one.multipliers for one in optima])
    rates = tuple(array.copy() for array in rounds.after)  # become rates
    about = (m, lam, net.leader, net.laplacian_pinv)
    _balances_about_optima(rounds.now, rates, block.arrays, gains, about, limit, balances)
    return Passivity.from_rows(balances)


def flow_passivities_of_block(block: TickBlock, flow: Flow, rounds: BlockRounds) -> list[Passivity]:
    """Return `flow_passivity` of T states and the two rounds that follow each when messages arrive within theirs."""
    balances, second = np.empty((len(rounds.now[0]), 4)), _next_rounds(rounds.after, block, flow)
    _flow_balances((*rounds, second), block.arrays, tuple(flow), balances)
    return Passivity.from_rows(balances)


def _next_rounds(states: tuple[np.ndarray, ...], block: TickBlock, flow: Flow) -> tuple[np.ndarray, ...]:
    """Return z, zeta, lam, nu of T states a round later when every message arrives within it, ticks first."""
    z, zeta, lam, nu = states
    after = (np.empty(z.shape), np.empty(zeta.shape), np.zeros(lam.shape), np.empty(nu.shape))
    _write_next_rounds(states, block.network.arrays, block.arrays, tuple(flow), after)
    return after


@kernel
def _write_next_rounds(states, graph, block_arrays, flow, after):
    """Write to `after`, like `states` and with lam all 0, what `_next_rounds` returns.

    `states` (four arrays, T first) are z, zeta, lam, nu of `Estimates` with T as their first axis, `graph` the members
    of `GraphArrays`, `block_arrays` of `BlockArrays`, `flow` of `Flow`. Both balances call this, so that it is compiled
    once.
    """
    block, gains, net = BlockArrays(*block_arrays), Flow(*flow), GraphArrays(*graph)
    for t in range(len(states[0])):
        problem, now = problem_at(block, t), _estimates_at(states, t)
        private = private_data(graph, (problem.p, problem.xi, problem.reference), problem.rows)
        received = ReceivedStates(net.first, net.neighbours, now.z, now.zeta)
        update_robots(now, _estimates_at(after, t), received, private, gains)


@kernel
def _balances_about_optima(states, after, block_arrays, flow, about, limit, balances):
    """Write a row of `balances` (T, 4) for every tick, NaN where the round leaves `limit`; turn `after` into rates.

    `states` and `after` are z, zeta, lam, nu of `Estimates` with T as their first axis, now and a round later,
    `block_arrays` the members of `BlockArrays`, `flow` of `Flow`; `about` the optima m (T, 2) and lam (T, n, R), leader
    (n,) and pinv (n, n), the pseudo-inverse of the Laplacian.
    """
    block, gains, (m, lam, leader, pinv) = BlockArrays(*block_arrays), Flow(*flow), about
    for t in range(len(m)):
        problem, now, rate = problem_at(block, t), _estimates_at(states, t), _estimates_at(after, t)
        if check_limits(rate.z, rate.lam, limit, gains.multiplier_cap)[0]:
            _to_rate(rate.z, now.z, gains.step)
            _to_rate(rate.zeta, now.zeta, gains.step)
            _to_rate(rate.lam, now.lam, gains.step)
            _to_rate(rate.nu, now.nu, gains.step)
            states_there, rows = (m[t], problem.p, problem.xi), problem.rows
            of_rows = (lam[t], rows.a, rows.C, rows.along)
            there = (*states_there, *of_rows, leader, problem.reference, pinv, gains.alpha)
            _write_balance(balance_about_optimum(there, now, rate), balances, t)
        else:
            _write_balance((np.nan, np.nan, np.nan, np.nan), balances, t)


@kernel
def _flow_balances(rounds, block_arrays, flow, balances):
    """Write a row of `balances` (T, 4) for every tick.

    `rounds` are the states before a round, after the first and after the second, each z, zeta, lam, nu of `Estimates`
    with T as their first axis; other arguments as above.
    """
    (before, first, second), block, gains = rounds, BlockArrays(*block_arrays), Flow(*flow)
    for t in range(len(balances)):
        rows = problem_at(block, t).rows
        three = (_estimates_at(before, t), _estimates_at(first, t), _estimates_at(second, t))
        balance = flow_balance(*three, (rows.a, rows.C, rows.along), gains.alpha, gains.step)
        _write_balance(balance, balances, t)


@kernel
def _estimates_at(states, t):
    """Return `Estimates` of tick t from z, zeta, lam, nu with T as their first axis."""
    z, zeta, lam, nu = states
    return Estimates(z[t], zeta[t], lam[t], nu[t])


@kernel
def _to_rate(after, before, step):
    """Turn an array a round later, after (n, N), into the rate of its change since before (n, N)."""
    for i in range(after.shape[0]):
        for c in range(after.shape[1]):
            after[i, c] = (after[i, c] - before[i, c]) / step


@kernel
def _write_balance(balance, balances, t):
    balances[t, 0], balances[t, 1], balances[t, 2], balances[t, 3] = balance
