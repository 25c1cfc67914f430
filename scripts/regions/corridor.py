"""A safe flight corridor around one segment: half-spaces from an ellipse that grows until every place is done with.

After Liu et al., "Planning dynamically feasible trajectories for quadrotors using safe flight corridors in 3-D complex
environments", RA-L 2(3), 2017, in the plane. Each place keeps an inset of its own in place of one robot's radius; where
the half-space that is moved inward by it would cut the segment, the normal is that across the shortest way to it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from regions.measures import Region

Insets = Callable[[np.ndarray], np.ndarray]

EXACT = 1e-9
SHORTEST = 0.02  # [m] of a segment; about a shorter one the ellipse begins as a circle


def corridor(places: np.ndarray, insets: Insets, path: np.ndarray) -> Region:
    """Return the half-spaces for a segment `path` (2, 2) [m] between places (k, 2) [m] that keep it their insets away.

    `insets` returns those (k, m) [m] along unit vectors (m, 2).
    """
    shape = ellipse(places, path)
    centre, left = path.mean(axis=0), np.ones(len(places), dtype=bool)
    G, h = [], []
    while left.any():
        offset = (places - centre) @ shape.T
        nearest = int(np.where(left, np.sum(offset**2, axis=1), np.inf).argmin())
        normal = shape.T @ offset[nearest]
        normal = normal / np.linalg.norm(normal)
        kept = places @ normal - insets(normal[None])[:, 0]
        if np.max(path @ normal) > kept[nearest]:
            normal = _across(places[nearest], path)
            kept = places @ normal - insets(normal[None])[:, 0]
        G.append(normal)
        h.append(kept[nearest])
        left &= kept < h[-1] - EXACT
        left[nearest] = False
    return Region(np.array(G).reshape(-1, 2), np.array(h))


def ellipse(places: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Return S (2, 2): the ellipse |S (q - centre)| <= 1 about the segment, as wide as places (k, 2) let it be."""
    along = path[1] - path[0]
    length = float(np.linalg.norm(along))
    if length < SHORTEST:
        return np.eye(2)
    axis = along / length
    frame = np.array([axis, [-axis[1], axis[0]]])
    x, y = (np.abs((places - path.mean(axis=0)) @ frame.T) / (0.5 * length)).T
    within = (x < 1.0) & (y > 0.0)
    # A place (x, y) is on the ellipse whose half-width is w where x^2 + (y / w)^2 = 1.
    width = float(np.min(y[within] / np.sqrt(1.0 - x[within] ** 2), initial=1.0))
    return np.diag([1.0, 1.0 / max(width, EXACT)]) @ frame / (0.5 * length)


def _across(place: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Return the direction from where a segment is nearest to a place to that place."""
    along = path[1] - path[0]
    share = np.clip((place - path[0]) @ along / max(along @ along, EXACT), 0.0, 1.0)
    across = place - path[0] - share * along
    return across / np.linalg.norm(across)
