"""Certificates of operation: numbers that say, tick by tick, whether the governor's guarantees hold."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.monitor.tick_block import BlockArrays, TickBlock, problem_at
from pbrg_mj.governor.problem.rows import motion_along
from pbrg_mj.kernel import kernel


class Diagnostics(NamedTuple):
    """How well one tick's answer serves, by all data of the tick."""

    applied_m: np.ndarray  # (2,) mean of the leaders' m [m]: what moves the team
    storage: float  # V = rho^2 / 2 at the applied m [m^2]
    storage_change: float  # V now less V a tick ago, both at the m applied then [m^2]; <= 0 in the ideal plant
    worst_row: float  # largest row of g at the applied m [m]; -inf without rows, > 0: the certificate does not hold
    consensus_spread: float  # largest distance between two robots' m_i [m]
    stationarity: float  # || sum delta 2 (m - r_i) + sum lambda grad g || [m]
    complementarity: float  # largest |lambda g| [m^2]


def diagnose(block: TickBlock, m: np.ndarray, multipliers: np.ndarray, before: Diagnostics | None) -> list[Diagnostics]:
    """Return the certificates of T ticks; `before` are those of the tick before them, None if there is none.

    `m` (T, n, 2) and `multipliers` (T, n, R) are a governor's answers. Stationarity, worst row (its positive part) and
    complementarity are the residuals of the KKT conditions, eq. 24, of the whole network's problem in m at the
    network's multipliers.
    """
    last_m, last_storage = (np.zeros(2), 0.0) if before is None else (before.applied_m, before.storage)
    applied, values = np.empty((len(m), 2)), np.empty((len(m), 6))
    _evaluate_ticks(block.network.leader, block.arrays, m, multipliers, last_m, last_storage, applied, values)
    if before is None:
        values[0, 1] = 0.0
    return list(map(Diagnostics, applied, *values.T.tolist()))


@kernel
def _evaluate_ticks(leader, block_arrays, m, lam, last_m, last_storage, applied, values):
    """Write of every tick the mean of the leaders' m to `applied` (T, 2), the other fields to `values` (T, 6).

    `block_arrays` are those of `TickBlock.arrays`, `leader` (n,), `m` (T, n, 2), `lam` (T, n, R), `last_m` (2,).
    """
    block = BlockArrays(*block_arrays)
    for t in range(len(m)):
        problem, mean = problem_at(block, t), _mean_of_leaders(leader, m[t])
        storage = _storage(mean, problem.p, problem.xi)
        if len(problem.rows.along) > 0:
            rows = _evaluate_rows_along(mean, problem, lam[t])
        else:
            rows = _evaluate_rows(mean, math.sqrt(2.0 * storage), lam[t], problem.rows)
        values[t, 0], values[t, 1] = storage, _storage(last_m, problem.p, problem.xi) - last_storage
        values[t, 2], values[t, 3] = rows.worst, _spread(m[t])
        values[t, 4], values[t, 5] = _stationarity(leader, mean, storage, problem, rows), rows.complementarity
        applied[t, 0], applied[t, 1] = mean[0], mean[1]
        last_m, last_storage = mean, storage


@kernel
def _mean_of_leaders(leader, m):
    leaders, mean = leader.sum(), np.zeros(2)
    for i in range(len(leader)):
        mean[0] += leader[i] * m[i, 0] / leaders
        mean[1] += leader[i] * m[i, 1] / leaders
    return mean


class _RowSums(NamedTuple):
    """What all rows together say at one m."""

    worst: float  # largest g [m]
    complementarity: float  # largest |lambda g| [m^2]
    pull: float  # sum of a lambda, the weight of grad rho; 0 where rows have directions
    push_x: float  # sum of C lambda, and of the gradients of ||x_G|| where rows have directions
    push_y: float


@kernel
def _evaluate_rows(m, rho, lam, rows):
    a, C, d = rows.a, rows.C, rows.d
    worst, largest = -np.inf, 0.0
    pull = push_x = push_y = 0.0
    for i in range(a.shape[0]):
        for row in range(a.shape[1]):
            pull += a[i, row] * lam[i, row]
            push_x += lam[i, row] * C[i, row, 0]
            push_y += lam[i, row] * C[i, row, 1]
            if rows.active[i, row]:
                g = a[i, row] * rho + C[i, row, 0] * m[0] + C[i, row, 1] * m[1] - d[i, row]
                worst, largest = max(worst, g), max(largest, abs(lam[i, row] * g))
    return _RowSums(worst, largest, pull, push_x, push_y)


@kernel
def _evaluate_rows_along(m, problem, lam):
    """Return the same of rows that have directions."""
    rows = problem.rows
    a, C, d, along = rows.a, rows.C, rows.d, rows.along
    worst, largest = -np.inf, 0.0
    push_x = push_y = 0.0
    for i in range(a.shape[0]):
        size = total = G_x = G_y = 0.0
        for row in range(a.shape[1]):
            if not rows.active[i, row]:
                continue
            if along[i, row, 0] != G_x or along[i, row, 1] != G_y:
                G_x, G_y = along[i, row, 0], along[i, row, 1]
                size, total = motion_along(m[0], m[1], problem.p, problem.xi, G_x, G_y)
            g = a[i, row] * size + C[i, row, 0] * m[0] + C[i, row, 1] * m[1] - d[i, row]
            worst, largest = max(worst, g), max(largest, abs(lam[i, row] * g))
            weight = a[i, row] * lam[i, row] * total / size if size > 0.0 else 0.0
            push_x += lam[i, row] * C[i, row, 0] + weight * G_x
            push_y += lam[i, row] * C[i, row, 1] + weight * G_y
    return _RowSums(worst, largest, 0.0, push_x, push_y)


@kernel
def _stationarity(leader, m, storage, problem, rows):
    """Return || sum delta 2 (m - r_i) + sum lambda grad g ||."""
    p, n, leaders = problem.p, len(problem.p), leader.sum()
    r = _mean_of_leaders(leader, problem.reference)
    rho = math.sqrt(2.0 * storage)
    weight = rows.pull / rho if rho > 0.0 else 0.0
    sum_x = sum_y = 0.0
    for j in range(n):
        sum_x += p[j, 0]
        sum_y += p[j, 1]
    x = rows.push_x + (2.0 * leaders * (m[0] - r[0]) + weight * (n * m[0] - sum_x))
    y = rows.push_y + (2.0 * leaders * (m[1] - r[1]) + weight * (n * m[1] - sum_y))
    return math.hypot(x, y)


@kernel
def _storage(m, p, xi):
    """Return half of rho^2 [m^2] of m (2,), p and xi (n, 2)."""
    total = 0.0
    for j in range(len(p)):
        total += (m[0] - p[j, 0]) ** 2 + (m[1] - p[j, 1]) ** 2 + xi[j, 0] ** 2 + xi[j, 1] ** 2
    return 0.5 * total


@kernel
def _spread(m):
    largest = 0.0
    for i in range(len(m)):
        for k in range(i):
            largest = max(largest, (m[i, 0] - m[k, 0]) ** 2 + (m[i, 1] - m[k, 1]) ** 2)
    return math.sqrt(largest)
