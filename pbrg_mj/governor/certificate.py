"""From half-spaces to rows of g: which references are safe in the present state.

With constant m, V = rho^2 / 2 never grows, rho(m, p, xi) = ||(1 (x) m - p, xi)||. So a half-space holds for ever, for
every robot, when the whole ball of radius rho around the formation at m lies behind it (eq. 9b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.half_spaces import HalfSpaces


@dataclass(frozen=True)
class Rows:
    """Rows a rho(m, z_p, z_xi) + C m - d <= 0 of every robot's private constraint g_i.

    Convex in z because a >= 0.
    """

    a: np.ndarray  # (n, R) weight of rho
    C: np.ndarray  # (n, R, 2)
    d: np.ndarray  # (n, R) [m]
    active: np.ndarray  # (n, R) bool; other rows do not exist


def ball_rows(half_spaces: HalfSpaces, formation: np.ndarray) -> Rows:
    """Return eq. 9b: rho + G.(m + b_j) - h <= 0 for every half-space of robot i and every robot j that it binds.

    Eq. 9a, G.(m + b_j) - h <= 0, is implied since rho >= 0. `formation` is b, (n, 2). Row k * n + j belongs to
    slot k and robot j.
    """
    n, slots = half_spaces.h.shape
    shape = (n, slots, n)
    d = half_spaces.h[:, :, None] - half_spaces.G @ formation.T
    C = np.broadcast_to(half_spaces.G[:, :, None, :], (*shape, 2))
    rows = slots * n
    return Rows(np.ones((n, rows)), C.reshape(n, rows, 2), d.reshape(n, rows), half_spaces.binds.reshape(n, rows))


def rho(m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> float:
    """Return ||(1 (x) m - p, xi)||, the radius of the ball; m (2,), p and xi (n, 2) [m]."""
    return float(np.sqrt(np.sum((m - p) ** 2) + np.sum(xi**2)))


def row_values(rows: Rows, m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return g (n, R) at one m (2,) and the state p, xi (n, 2); -inf where there is no row."""
    return np.where(rows.active, rows.a * rho(m, p, xi) + rows.C @ m - rows.d, -np.inf)
