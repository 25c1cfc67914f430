"""What every velocity filter offers to the loop."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pbrg_mj.governor.problem.interface import Problem, Solution


class VelocityFilter(Protocol):
    """Frozen parameters and no memory.

    Robot j's velocity may depend on its own data, on p and xi of its neighbours, which eq. 2 has sent, and on where
    robots beside it are, which it sees: no filter has messages of its own. Where a scenario has several, each takes
    what the one before it answered. xi is integrated as eq. 2 says, whatever is driven; where a scenario asks for
    `control.separation`, so is p: what filters change then displaces a robot from p + b.
    """

    def filtered(
        self, problem: Problem, solution: Solution, hand_world: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """Return the velocities (n, 2) to drive [m/s].

        `velocity` (n, 2) [m/s] is that of eq. 2 under the governed references of `solution`; `hand_world` (n, 2) [m]
        is q as estimated.
        """
        ...


def known_half_spaces(problem: Problem) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return G, h, active and binds of the robots' half-spaces. Raises ValueError for a problem without any."""
    spaces = problem.half_spaces
    if spaces is None:
        raise ValueError("a velocity filter needs half-spaces in the problem")
    return spaces.G, spaces.h, spaces.active, spaces.binds
