"""What velocity filters make of velocities, whatever the governor answered."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter


def driven_by(one: VelocityFilter, problem: Problem, q: np.ndarray, u: np.ndarray, status: Status = "ok") -> np.ndarray:
    """The velocities (n, 2) to drive [m/s] of robots at q (n, 2) [m] in place of u (n, 2) [m/s]."""
    return one.filtered(problem, Solution.of(problem, np.zeros(2), status), q, u)
