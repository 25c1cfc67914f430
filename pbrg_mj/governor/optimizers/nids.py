"""NIDS, the network-independent step size algorithm of Li, Shi and Yan (2019), with a local projection.

With s_i(m) = delta_i ||r_i - m||^2, P_i the projection on X_i and W = I - w L, robot i does

    z_i <- z_i - m_i + sum_j W_ij y_j,    m_i <- P_i(z_i),
    y_i <- 2 m_i - m_i(before) - c (grad s_i(m_i) - grad s_i(m_i(before)))

and sends y_i, two numbers. For convex s_i with Lipschitz gradients (their constant is 2 here), closed convex X_i that
have a point in common, a connected graph, 0 < c < 1 and 0 < w <= 1 / lambda_max(L) all m_i converge to the optimum: c
need not know the network.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.nearest import nearest_admissible
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, cost_gradient


class NidsMemory(NamedTuple):
    """What one robot remembers."""

    z: np.ndarray  # (2,)
    m: np.ndarray  # (2,)
    gradient: np.ndarray  # (2,) of s_i at m, as it was then
    y: np.ndarray  # (2,)


@dataclass(frozen=True)
class Nids:
    """The algorithm's parameters."""

    step: float  # c
    weight: float  # w
    numbers: int = 2

    def start(self, facts: RobotFacts, local: LocalProblem) -> NidsMemory:
        """Return the first iterate, after a step from the robot's own p."""
        m = local.own.p
        gradient = cost_gradient(local, m)
        return self._moved(local, m - self.step * gradient, m, gradient)

    def message(self, memory: NidsMemory) -> np.ndarray:
        """Return y_i."""
        return memory.y

    def step_once(self, local: LocalProblem, memory: NidsMemory, received: np.ndarray) -> NidsMemory:
        """Return the memory after one iteration."""
        mixed = memory.y - self.weight * (len(received) * memory.y - received.sum(axis=0))
        return self._moved(local, memory.z - memory.m + mixed, memory.m, memory.gradient)

    def candidate(self, local: LocalProblem, memory: NidsMemory) -> np.ndarray:
        """Return m_i."""
        return memory.m

    def _moved(self, local: LocalProblem, z: np.ndarray, before: np.ndarray, gradient: np.ndarray) -> NidsMemory:
        m, _ = nearest_admissible(local.rows, local.spread, z)
        now = cost_gradient(local, m)
        return NidsMemory(z, m, now, 2.0 * m - before - self.step * (now - gradient))
