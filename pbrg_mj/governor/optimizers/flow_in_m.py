"""The primal-dual flow with PI consensus in m alone, with augmented multipliers, by Euler steps.

The paper's flow (eqs. 25-30) agrees on z in R^(4n + 2); with the states known by other means m in R^2 is left:

    m_i      <- m_i - h (sum_j (m_i - m_j) + sum_j (v_i - v_j) + gain (grad s_i + grad g_i' [lambda_i + k g_i]_+))
    v_i      <- v_i + h sum_j (m_i - m_j)
    lambda_i <- [lambda_i + h g_i]_+

g_i being robot i's rows at m_i, k the augmentation. It sends (m_i, v_i), four numbers. The continuous flow of a convex
problem converges; the largest step h of its Euler steps depends on the graph and on the rows: those of balls, steeper
and curved, need shorter ones than half-planes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, cost_gradient


class FlowMemory(NamedTuple):
    """What one robot remembers."""

    m: np.ndarray  # (2,)
    v: np.ndarray  # (2,) integral state of the PI consensus
    lam: np.ndarray  # (R,) multipliers of its rows


@dataclass(frozen=True)
class FlowInM:
    """The flow's parameters."""

    step: float  # h
    gain: float
    augmentation: float  # k
    numbers: int = 4

    def start(self, facts: RobotFacts, local: LocalProblem) -> FlowMemory:
        """Return the first iterate, the robot's own p."""
        return FlowMemory(local.own.p, np.zeros(2), np.zeros(local.rows.d.size))

    def message(self, memory: FlowMemory) -> np.ndarray:
        """Return m_i and v_i."""
        return np.concatenate([memory.m, memory.v])

    @np.errstate(over="ignore", invalid="ignore")  # iterates that diverge are found out by who asks for a candidate
    def step_once(self, local: LocalProblem, memory: FlowMemory, received: np.ndarray) -> FlowMemory:
        """Return the memory after one iteration."""
        m, v, h = memory.m, memory.v, self.step
        lam = memory.lam if len(memory.lam) == local.rows.d.size else np.zeros(local.rows.d.size)
        g, gradient = _rows_at(local, m)
        push = gradient.T @ np.maximum(lam + self.augmentation * g, 0.0)
        apart = len(received) * np.concatenate([m, v]) - received.sum(axis=0)
        pull = self.gain * (cost_gradient(local, m) + push)
        return FlowMemory(
            m=m - h * (apart[:2] + apart[2:] + pull),
            v=v + h * apart[:2],
            lam=np.maximum(lam + h * g, 0.0),
        )

    def candidate(self, local: LocalProblem, memory: FlowMemory) -> np.ndarray:
        """Return m_i."""
        return memory.m


def _rows_at(local: LocalProblem, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the values (R,) and gradients (R, 2) of a robot's rows at m; a row that does not exist is 0 and flat."""
    rows = local.rows
    a, C, d, active = rows.a[0], rows.C[0], rows.d[0], rows.active[0]
    n, mean, square = local.spread
    radius = np.sqrt(n * np.sum((m - mean) ** 2) + square)
    along = n * (m - mean) / radius if radius > 0.0 else np.zeros(2)
    g = np.where(active, a * radius + C @ m - d, 0.0)
    return g, np.where(active[:, None], a[:, None] * along + C, 0.0)
