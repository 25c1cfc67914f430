"""Rows of constraints: what a certificate makes, and every governor and solver takes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

ALL_MOTION = np.zeros((0, 0, 2))


class Rows(NamedTuple):
    """Rows a ||x|| + C m - d <= 0 of every robot's private constraint g_i.

    x is all motion, (1 (x) m - z_p, z_xi), and ||x|| = rho; or, where the rows have directions G, the motion along the
    row's own: x_G = (G.m - G.z_pj, G.z_xij) of all robots j. Convex in z because a >= 0.
    """

    a: np.ndarray  # (n, R) weight of ||x||
    C: np.ndarray  # (n, R, 2)
    d: np.ndarray  # (n, R) [m]
    active: np.ndarray  # (n, R) bool; other rows do not exist
    along: np.ndarray = ALL_MOTION  # (n, R, 2) unit vectors G, or (0, 0, 2): ||x|| is rho in all rows


def stacked(first: Rows, second: Rows) -> Rows:
    """Return both robots' rows side by side."""
    return Rows(*(np.concatenate(pair, axis=1) for pair in zip(first, second, strict=True)))


def rho(m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> float:
    """Return ||(1 (x) m - p, xi)||, the radius of the ball; m (2,), p and xi (n, 2) [m]."""
    return float(np.sqrt(np.sum((m - p) ** 2) + np.sum(xi**2)))


def rho_along(G: np.ndarray, m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return ||x_G|| (...,) of unit vectors G (..., 2): the radius of the ball of the motion along them."""
    return np.sqrt(np.sum((G @ (m - p).T) ** 2, axis=-1) + np.sum((G @ xi.T) ** 2, axis=-1))


def row_values(rows: Rows, m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return g (n, R) at one m (2,) and the state p, xi (n, 2); -inf where there is no row."""
    size = rho_along(rows.along, m, p, xi) if len(rows.along) else rho(m, p, xi)
    return np.where(rows.active, rows.a * size + rows.C @ m - rows.d, -np.inf)


@kernel
def motion_along(m_x, m_y, p, xi, G_x, G_y):
    """Return ||x_G|| and sum_j G.(m - p_j), over ||x_G|| the former's slope along G; p, xi (n, 2) [m]."""
    square = total = 0.0
    for j in range(len(p)):
        e = G_x * (m_x - p[j, 0]) + G_y * (m_y - p[j, 1])
        s = G_x * xi[j, 0] + G_y * xi[j, 1]
        total += e
        square += e * e + s * s
    return math.sqrt(square), total
