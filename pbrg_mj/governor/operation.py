"""Certificates of operation: numbers that say, tick by tick, whether the governor's guarantees hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate import row_values
from pbrg_mj.governor.problem import Problem, Solution


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
    lead = problem.network.leader > 0
    m = solution.m[lead].mean(axis=0)
    p, xi, rows = problem.p, problem.xi, problem.rows
    offset = m - p
    storage = 0.5 * float(np.sum(offset**2) + np.sum(xi**2))
    change = 0.0
    if before is not None:
        held = before.applied_m
        change = 0.5 * float(np.sum((held - p) ** 2) + np.sum(xi**2)) - before.storage
    values = row_values(rows, m, p, xi)
    lam = solution.multipliers
    radius = np.sqrt(2.0 * storage)
    grad_rho = offset.sum(axis=0) / radius if radius > 0 else np.zeros(2)
    gradient = 2.0 * lead.sum() * (m - problem.reference) + np.sum(rows.a * lam) * grad_rho
    gradient = gradient + np.einsum("ir,irc->c", lam, rows.C)
    spread = solution.m[:, None] - solution.m
    return Operation(
        applied_m=m,
        storage=storage,
        storage_change=change,
        worst_row=float(values.max(initial=-np.inf)),
        consensus_spread=float(np.sqrt((spread**2).sum(axis=2).max())),
        stationarity=float(np.hypot(*gradient)),
        complementarity=float(np.abs(lam * np.where(rows.active, values, 0.0)).max(initial=0.0)),
    )
