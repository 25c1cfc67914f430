"""What the robots remember between rounds, and the parameters of the flow that they integrate.

z_i = (m, z_p1, ..., z_pn, z_xi1, ..., z_xin) in R^(4n + 2) is robot i's estimate of the network's optimum (eq. 18).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Flow(NamedTuple):
    """Parameters of the flow that every robot integrates.

    With a finite `multiplier_cap` mu the network minimizes f + mu sum max(g, 0), the exact penalty: the same optimum
    while every optimal multiplier is below mu, and the least violation instead of runaway when nothing is admissible.
    Explicit rounds are Euler steps of the flow; `proximal` ones have its fixed points, and a step bound of their own.
    """

    alpha: float  # gain
    step: float  # of one round [s]
    multiplier_cap: float = math.inf
    proximal: bool = False


class Estimates(NamedTuple):
    """What the robots remember between rounds; row i is robot i's own."""

    z: np.ndarray  # (n, 4n + 2)
    zeta: np.ndarray  # (n, 4n + 2) integral states of the PI consensus
    lam: np.ndarray  # (n, R) multipliers of g_i <= 0; 0 where there is no row
    nu: np.ndarray  # (n, 4) multipliers of h_i = (z_pi - p_i, z_xii - xi_i) = 0
