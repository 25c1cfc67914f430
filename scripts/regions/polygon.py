"""Convex polygons in the plane: cut by half-spaces, their areas, and hulls around discs."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

CORNERS = 32  # of a polygon around a disc: it is no more than 0.5 % wider


def cut(corners: np.ndarray, G: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Return the corners (c, 2) [m] of what half-spaces G q <= h, G (k, 2), leave of a convex polygon, in its order."""
    for normal, offset in zip(G, h, strict=True):
        if not len(corners):
            break
        beyond = corners @ normal - offset
        kept = []
        for k, (here, after) in enumerate(zip(beyond, np.roll(beyond, -1), strict=True)):
            if here <= 0.0:
                kept.append(corners[k])
            if here * after < 0.0:
                kept.append(corners[k] + here / (here - after) * (corners[(k + 1) % len(corners)] - corners[k]))
        corners = np.array(kept).reshape(-1, 2)
    return corners


def area(corners: np.ndarray) -> float:
    """Return the area [m^2] of a polygon whose corners (c, 2) go counter-clockwise; 0 for less than a triangle."""
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def distance(place: np.ndarray, corners: np.ndarray) -> float:
    """Return how far [m] a place (2,) is from a convex polygon (c, 2), counter-clockwise; 0 in it, inf from none."""
    if not len(corners):
        return np.inf
    side = np.roll(corners, -1, axis=0) - corners
    x, y = (place - corners).T
    if len(corners) > 2 and np.all(side[:, 0] * y - side[:, 1] * x >= 0.0):
        return 0.0
    squared = np.maximum(np.sum(side**2, axis=1), 1e-18)
    share = np.clip((x * side[:, 0] + y * side[:, 1]) / squared, 0.0, 1.0)
    return float(np.linalg.norm(place - corners - share[:, None] * side, axis=1).min())


def inside_disc(centre: np.ndarray, radius: float, corners: int = 64) -> np.ndarray:
    """Return the corners of a regular polygon, counter-clockwise, on a circle."""
    angle = 2 * np.pi * np.arange(corners) / corners
    return centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def around_discs(centres: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return G (k, 2), h (k,) [m] of a convex polygon around discs: each as a regular polygon that holds it."""
    return around(centres, np.broadcast_to(radii[:, None], (len(centres), CORNERS)))


def directions() -> np.ndarray:
    """Return unit vectors (CORNERS, 2), counter-clockwise."""
    return inside_disc(np.zeros(2), 1.0, CORNERS)


def around(centres: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return G (k, 2), h (k,) [m] of the hull of polygons, each about a centre as far as `reach` (n, CORNERS) [m].

    A polygon is what all `directions` leave, which reach so far.
    """
    normals, square = directions(), 10.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    parts = [centre + cut(square, normals, one) for centre, one in zip(centres, reach, strict=True)]
    hull = ConvexHull(np.concatenate(parts))
    return hull.equations[:, :2], -hull.equations[:, 2]
