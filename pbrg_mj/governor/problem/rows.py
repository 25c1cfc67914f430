"""Rows of constraints: what a certificate makes, and every governor and solver takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Rows(NamedTuple):
    """Rows a rho(m, z_p, z_xi) + C m - d <= 0 of every robot's private constraint g_i.

    Convex in z because a >= 0.
    """

    a: np.ndarray  # (n, R) weight of rho
    C: np.ndarray  # (n, R, 2)
    d: np.ndarray  # (n, R) [m]
    active: np.ndarray  # (n, R) bool; other rows do not exist


def stacked(first: Rows, second: Rows) -> Rows:
    """Return both robots' rows side by side."""
    return Rows(*(np.concatenate(pair, axis=1) for pair in zip(first, second, strict=True)))


def rho(m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> float:
    """Return ||(1 (x) m - p, xi)||, the radius of the ball; m (2,), p and xi (n, 2) [m]."""
    return float(np.sqrt(np.sum((m - p) ** 2) + np.sum(xi**2)))


def row_values(rows: Rows, m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return g (n, R) at one m (2,) and the state p, xi (n, 2); -inf where there is no row."""
    return np.where(rows.active, rows.a * rho(m, p, xi) + rows.C @ m - rows.d, -np.inf)
