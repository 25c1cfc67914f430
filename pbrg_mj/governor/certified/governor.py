"""The certified governor with messages that always arrive: what its robots conclude, computed at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.speed import SpeedLimit
from pbrg_mj.governor.certified.decide import next_reference
from pbrg_mj.governor.problem.interface import Problem, Solution


@dataclass(frozen=True)
class CertifiedGovernor:
    """Leaders move towards the nearest certified point to r."""

    speed: SpeedLimit | None

    def init(self, problem: Problem) -> np.ndarray:
        """Return the first held reference, the mean of the shifted hand points, (2,)."""
        return problem.p.mean(axis=0)

    def step(self, problem: Problem, memory: np.ndarray) -> tuple[Solution, np.ndarray]:
        """Return this tick's reference."""
        m, admissible = next_reference(problem, memory, self.speed)
        return Solution.of(problem, m, "ok" if admissible else "infeasible"), m
