"""The certified governor with messages that always arrive: what its robots conclude, computed at once.

Within one tick the robots flood two kinds of items, each passed on once by every robot to all its neighbours:

1. for `diameter` rounds, of every robot j: p_j, xi_j, its heading, and the m it holds; then every robot knows the team;
2. for `diameter` rounds, of every half-space its owner's verdict: the normal G and the interval of G.m that it allows.

Then all leaders have the same data, and each finds the same m from them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.speed import SpeedLimit
from pbrg_mj.governor.certified.decide import next_reference
from pbrg_mj.governor.problem.interface import Problem, Solution

HEADER = 4  # bytes of an item's robot and slot
STATE_ITEM = HEADER + 8 * 7  # p, xi, m in the plane, and the heading
VERDICT_ITEM = HEADER + 8 * 4  # G, and both ends of the interval


@dataclass(frozen=True)
class CertifiedGovernor:
    """Leaders move towards the nearest certified point to r."""

    speed: SpeedLimit | None  # None: no limit on velocities
    diameter: int  # of the graph: rounds until an item has reached everybody

    def init(self, problem: Problem) -> np.ndarray:
        """Return the first held reference, the mean of the shifted hand points, (2,)."""
        return problem.p.mean(axis=0)

    def step(self, problem: Problem, memory: np.ndarray) -> tuple[Solution, np.ndarray]:
        """Return this tick's reference; `infeasible` where no reference is admissible."""
        m, admissible = next_reference(problem, memory, self.speed)
        n, active = problem.network.robots, problem.rows.active
        verdicts = int(active.reshape(n, -1, 2).any(axis=2).sum())
        solution = Solution(
            m=np.tile(m, (n, 1)),
            multipliers=np.zeros_like(problem.rows.d),
            status="ok" if admissible else "infeasible",
            rounds=2 * self.diameter,
            bytes_sent=(problem.network.degree * (n * STATE_ITEM + verdicts * VERDICT_ITEM)).astype(np.int64),
        )
        return solution, m
