"""Certificates of operation: numbers that say, tick by tick, whether the governor's guarantees hold."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.monitor.tick_block import TickBlock, problem_at
from pbrg_mj.kernel import kernel


class Diagnostics(NamedTuple):
    """How well one tick's answer serves, by all data of the tick."""

    applied_m: np.ndarray  # (2,) mean of the leaders' m [m]: what moves the team
    storage: float  # V = rho^2 / 2 at the applied m [m^2]
    storage_change: float  # V now less V a tick ago, both at the m applied then [m^2]; <= 0 in the ideal plant
    worst_row: float  # largest row of g at the applied m [m]; -inf without rows, > 0: the certificate does not hold
    consensus_spread: float  # largest distance between two robots' m_i [m]
    stationarity: float  # || sum delta 2 (m - r) + sum lambda grad g || [m]
    complementarity: float  # largest |lambda g| [m^2]


def diagnose(block: TickBlock, m: np.ndarray, multipliers: np.ndarray, before: Diagnostics | None) -> list[Diagnostics]:
    """Return the certificates of T ticks; `before` are those of the tick before them, None if there is none.

    `m` (T, n, 2) and `multipliers` (T, n, R) are a governor's answers. Stationarity, worst row (its positive part) and
    complementarity are the residuals of the KKT conditions, eq. 24, of the whole network's problem in m at the
    network's multipliers.
    """
    last = (np.zeros(2), 0.0) if before is None else (before.applied_m, before.storage)
    applied, values = np.empty((len(m), 2)), np.empty((len(m), 6))
    _evaluate_ticks(block.network.leader, block.arrays, (m, multipliers), last, applied, values)
    if before is None:
        values[0, 1] = 0.0
    return list(map(Diagnostics, applied, *values.T.tolist()))


@kernel
def _evaluate_ticks(leader, problems, answers, last, applied, values):  # pragma: no cover - compiled
    """Write the fields of every tick's Diagnostics, in their order."""
    (m, lam), (last_m, last_storage) = answers, last
    for t in range(len(m)):
        (p, xi, r), rows = problem_at(problems, t)
        now = _evaluate((leader, r, m[t], lam[t]), (p, xi), rows, (last_m, last_storage))
        last_m, last_storage = now[0], now[1]
        applied[t, 0], applied[t, 1] = last_m[0], last_m[1]
        values[t, 0], values[t, 1], values[t, 2] = now[1], now[2], now[3]
        values[t, 3], values[t, 4], values[t, 5] = now[4], now[5], now[6]


@kernel
def _evaluate(answer, state, rows, before):  # pragma: no cover - compiled
    """Return the fields of Diagnostics, in their order."""
    leader, r, known_m, lam = answer
    p, xi = state
    n, leaders, m = len(p), leader.sum(), np.zeros(2)
    for i in range(n):
        m[0] += leader[i] * known_m[i, 0] / leaders
        m[1] += leader[i] * known_m[i, 1] / leaders
    storage, held = _storage(m, p, xi), _storage(before[0], p, xi) - before[1]
    rho = math.sqrt(2.0 * storage)
    worst, complementarity, pull, push_x, push_y = _evaluate_rows(m, rho, lam, rows)
    weight = pull / rho if rho > 0.0 else 0.0
    sum_x = sum_y = 0.0
    for j in range(n):
        sum_x += p[j, 0]
        sum_y += p[j, 1]
    x = push_x + (2.0 * leaders * (m[0] - r[0]) + weight * (n * m[0] - sum_x))
    y = push_y + (2.0 * leaders * (m[1] - r[1]) + weight * (n * m[1] - sum_y))
    return m, storage, held, worst, _spread(known_m), math.hypot(x, y), complementarity


@kernel
def _evaluate_rows(m, rho, lam, rows):  # pragma: no cover - compiled
    """Return the largest row, the largest |lambda g|, sum of a lambda and sum of C lambda."""
    a, C, d, active = rows
    worst, largest = -np.inf, 0.0
    pull = push_x = push_y = 0.0
    for i in range(a.shape[0]):
        for row in range(a.shape[1]):
            pull += a[i, row] * lam[i, row]
            push_x += lam[i, row] * C[i, row, 0]
            push_y += lam[i, row] * C[i, row, 1]
            if active[i, row]:
                g = a[i, row] * rho + C[i, row, 0] * m[0] + C[i, row, 1] * m[1] - d[i, row]
                worst, largest = max(worst, g), max(largest, abs(lam[i, row] * g))
    return worst, largest, pull, push_x, push_y


@kernel
def _storage(m, p, xi):  # pragma: no cover - compiled
    total = 0.0
    for j in range(len(p)):
        total += (m[0] - p[j, 0]) ** 2 + (m[1] - p[j, 1]) ** 2 + xi[j, 0] ** 2 + xi[j, 1] ** 2
    return 0.5 * total


@kernel
def _spread(m):  # pragma: no cover - compiled
    largest = 0.0
    for i in range(len(m)):
        for k in range(i):
            largest = max(largest, (m[i, 0] - m[k, 0]) ** 2 + (m[i, 1] - m[k, 1]) ** 2)
    return math.sqrt(largest)
