"""The centralized reference: the same problem with everything known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pbrg_mj.governor.certificate import Rows


@dataclass(frozen=True)
class Optimum:
    """What the centralized solver found."""

    m: np.ndarray  # (2,) m* [m]; NaN unless solved
    status: Literal["solved", "infeasible", "failed"]
    cost: float  # number of leaders times ||r - m*||^2 [m^2]; NaN unless solved
    multipliers: np.ndarray  # (n, R) lambda*, one per row; NaN unless solved
    solver_status: str  # in the solver's own words
    build_seconds: float  # wall clock
    solve_seconds: float  # wall clock
