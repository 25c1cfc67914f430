"""The point nearest to another one behind lines in the plane."""

from __future__ import annotations

import numpy as np

PARALLEL = 1e-12  # rows whose determinant is smaller have no corner
FEASIBLE = 1e-9  # [m] rounding allowed when a candidate is tested against the other rows


def nearest(r: np.ndarray, C: np.ndarray, d: np.ndarray) -> np.ndarray | None:
    """Return the minimiser (2,) of ||m - r|| subject to C m <= d, unit rows C (H, 2); None when infeasible.

    Exact: in the plane at most two rows carry the optimum, so all sets of 0, 1 and 2 active rows are tried.
    """
    candidates = np.array([r, *_projections(r, C, d), *_corners(C, d)])
    slack = FEASIBLE * (1.0 + np.abs(d))
    feasible = candidates[np.all(candidates @ C.T <= d + slack, axis=1)]
    if not len(feasible):
        return None
    return feasible[np.argmin(np.linalg.norm(feasible - r, axis=1))]


def _projections(r: np.ndarray, C: np.ndarray, d: np.ndarray) -> np.ndarray:
    return r - (C @ r - d)[:, None] * C


def _corners(C: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the points (P, 2) at which two rows meet, all pairs at once: thousands of choices have some 200 each."""
    i, j = np.triu_indices(len(d), 1)
    pairs, sides = np.stack([C[i], C[j]], axis=1), np.stack([d[i], d[j]], axis=1)
    meet = np.abs(np.linalg.det(pairs)) > PARALLEL
    return np.linalg.solve(pairs[meet], sides[meet][..., None])[..., 0]
