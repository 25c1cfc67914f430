"""Certificates of operation: numbers that say, tick by tick, whether the governor's guarantees hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem import Problem, Solution
from pbrg_mj.kernel import kernel


@dataclass(frozen=True)
class Operation:
    """How well one tick's answer serves, judged with everything known. Nothing of it is fed back."""

    applied_m: np.ndarray  # (2,) mean of the leaders' m [m]: what moves the team
    storage: float  # V = rho^2 / 2 at the applied m [m^2]
    storage_change: float  # V now less V a tick ago, both at the m applied then [m^2]; <= 0 in the ideal plant
    worst_row: float  # largest row of g at the applied m [m]; -inf without rows, > 0: the certificate does not hold
    consensus_spread: float  # largest distance between two robots' m_i [m]
    stationarity: float  # || sum delta 2 (m - r) + sum lambda grad g || [m]
    complementarity: float  # largest |lambda g| [m^2]


def operation(problem: Problem, solution: Solution, before: Operation | None) -> Operation:
    """Return the certificates of one tick; `before` are those of the tick before, None in the first.

    Stationarity, worst row (its positive part) and complementarity are the residuals of the KKT conditions, eq. 24,
    of the whole network's problem in m at the network's multipliers.
    """
    rows, leader, nothing = problem.rows, problem.network.leader, (np.zeros(2), 0.0)
    m, *judged = _judged(
        (leader, problem.reference, solution.m, solution.multipliers),
        (problem.p, problem.xi),
        (rows.a, rows.C, rows.d, rows.active),
        nothing if before is None else (before.applied_m, before.storage),
    )
    storage, held, worst, spread, stationarity, complementarity = judged
    return Operation(
        applied_m=m,
        storage=storage,
        storage_change=0.0 if before is None else held,
        worst_row=worst,
        consensus_spread=spread,
        stationarity=stationarity,
        complementarity=complementarity,
    )


@kernel
def _judged(answer, state, rows, before):  # pragma: no cover - compiled
    leader, r, known_m, lam = answer
    p, xi = state
    n, leaders, m = len(p), leader.sum(), np.zeros(2)
    for i in range(n):
        m += leader[i] * known_m[i] / leaders
    storage, held = _storage(m, p, xi), _storage(before[0], p, xi) - before[1]
    rho = math.sqrt(2.0 * storage)
    worst, complementarity, pull, gradient = _judged_rows(m, rho, lam, rows)
    weight = pull / rho if rho > 0.0 else 0.0
    for axis in range(2):
        gradient[axis] += 2.0 * leaders * (m[axis] - r[axis]) + weight * (n * m[axis] - p[:, axis].sum())
    return m, storage, held, worst, _spread(known_m), math.hypot(gradient[0], gradient[1]), complementarity


@kernel
def _judged_rows(m, rho, lam, rows):  # pragma: no cover - compiled
    """Return the largest row, the largest |lambda g|, sum of a lambda and sum of C lambda."""
    a, C, d, active = rows
    worst, largest, pull, push = -np.inf, 0.0, 0.0, np.zeros(2)
    for i in range(a.shape[0]):
        for row in range(a.shape[1]):
            pull += a[i, row] * lam[i, row]
            push[0] += lam[i, row] * C[i, row, 0]
            push[1] += lam[i, row] * C[i, row, 1]
            if active[i, row]:
                g = a[i, row] * rho + C[i, row, 0] * m[0] + C[i, row, 1] * m[1] - d[i, row]
                worst, largest = max(worst, g), max(largest, abs(lam[i, row] * g))
    return worst, largest, pull, push


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
