"""Consensus by the alternating direction method of multipliers, with a local projection.

Boyd, Parikh, Chu, Peleato and Eckstein (2011), section 7, in the form without a centre of Shi, Ling, Yuan, Wu and Yin
(2014): robot i with d_i neighbours does

    a_i <- a_i + c sum_j (m_i - m_j)
    m_i <- argmin over X_i of  delta_i ||r_i - m||^2 + a_i.m + c sum_j ||m - (m_i + m_j) / 2||^2

and sends m_i, two numbers. What is minimized has circles for level sets, so the second line projects its free
minimizer on X_i. For convex closed problems with a solution and a connected graph all m_i converge to the optimum for
every c > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.nearest import nearest_admissible
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem


class AdmmMemory(NamedTuple):
    """What one robot remembers."""

    m: np.ndarray  # (2,)
    a: np.ndarray  # (2,) multiplier; those of all robots add up to 0


@dataclass(frozen=True)
class Admm:
    """The algorithm's parameter."""

    penalty: float  # c
    numbers: int = 2

    def start(self, facts: RobotFacts, local: LocalProblem) -> AdmmMemory:
        """Return the first iterate, the robot's own p."""
        return AdmmMemory(local.own.p, np.zeros(2))

    def message(self, memory: AdmmMemory) -> np.ndarray:
        """Return m_i."""
        return memory.m

    def step_once(self, local: LocalProblem, memory: AdmmMemory, received: np.ndarray) -> AdmmMemory:
        """Return the memory after one iteration."""
        m, c, d, others = memory.m, self.penalty, len(received), received.sum(axis=0)
        a = memory.a + c * (d * m - others)
        pull, weight = c * (d * m + others) - a, 2.0 * c * d
        if local.reference is not None:
            pull, weight = pull + 2.0 * local.reference, weight + 2.0
        after, _ = nearest_admissible(local.rows, local.spread, pull / weight)
        return AdmmMemory(after, a)

    def candidate(self, local: LocalProblem, memory: AdmmMemory) -> np.ndarray:
        """Return m_i."""
        return memory.m
