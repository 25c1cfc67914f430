"""No optimizer: the candidate is r itself, so that the certified layer is the scalar reference governor.

(Gilbert and Kolmanovsky 1999.) It stops where the way straight to r meets the first row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem


@dataclass(frozen=True)
class Scalar:
    """There is nothing to choose and nothing to send."""

    numbers: int = 0

    def start(self, facts: RobotFacts, local: LocalProblem) -> None:
        """There is nothing to remember."""

    def message(self, memory: None) -> np.ndarray:
        """Return nothing, (0,)."""
        return np.zeros(0)

    def step_once(self, local: LocalProblem, memory: None, received: np.ndarray) -> None:
        """There are no iterations."""

    def candidate(self, local: LocalProblem, memory: None) -> np.ndarray:
        """Return r_i; of a robot that does not lead its own p."""
        return local.own.p if local.reference is None else local.reference
