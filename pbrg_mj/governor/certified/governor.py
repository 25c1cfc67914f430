"""The certified governor with messages that always arrive within their round, computed for all robots at once.

It does in every tick what `robot.CertifiedProgram` does in a cycle of one tick, bit for bit: two floods of `diameter`
rounds each. Then all leaders have the same data, and each finds the same m from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certified.compiled import CompiledDecision, Decision
from pbrg_mj.governor.certified.decide import AdvanceLimit, next_reference
from pbrg_mj.governor.certified.flood import COUNT, ITEM
from pbrg_mj.governor.certified.robot import INTERVAL
from pbrg_mj.governor.problem.interface import Problem, Solution


@dataclass(frozen=True)
class CertifiedGovernor:
    """Leaders move towards the nearest certified point to r."""

    limits: tuple[AdvanceLimit, ...]
    diameter: int  # of the graph: rounds until an item has reached every robot
    reach: float  # of a retreat [m]
    compiled: CompiledDecision | None = None  # of the same limits; None: by the problem's rows, in NumPy
    farthest: float = math.inf  # that r may be from the mean of p [m]
    state_bytes: int = 56  # that a robot floods of its state: `robot.state_struct`

    def init(self, problem: Problem) -> np.ndarray:
        """Return the first held reference, the mean of the shifted hand points, of motors where they stop, (2,)."""
        return problem.prediction_state[0].mean(axis=0)

    def step(self, problem: Problem, memory: np.ndarray) -> tuple[Solution, np.ndarray]:
        """Return this tick's reference; `inadmissible` or `infeasible` where no m near the team, or none, is."""
        network, decided = problem.network, (self._by_rows if self.compiled is None else self.compiled.next_reference)
        m, status, intervals = decided(problem, memory)
        of_robot = ITEM.size + self.state_bytes + ITEM.size + COUNT.size  # bytes
        flooded = network.robots * of_robot + intervals * INTERVAL.size
        solution = Solution(
            m=m,
            multipliers=np.zeros(problem.rows_shape),
            status=status,
            rounds=2 * self.diameter,
            bytes_sent=network.times_degree(flooded),
            lost=network.times_degree(0),
        )
        return solution, m[0]

    def _by_rows(self, problem: Problem, held: np.ndarray) -> Decision:
        m, status = next_reference(problem, held, self.limits, self.reach, self.farthest)
        there = problem.rows.active.reshape(-1, 2)
        intervals = int(np.count_nonzero(there[:, 0] | there[:, 1]))
        return Decision(m[None].repeat(problem.network.robots, axis=0), status, intervals)
