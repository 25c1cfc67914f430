"""Distances of points from what stands on the floor, 0 inside."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.scenario.polygons import is_simple
from pbrg_mj.scenario.schema import Column, Prism, Vector, Wall


def distance_to_wall(wall: Wall, point: Vector) -> float:
    """Return the distance of a point from a wall's box, 0 inside it [m]; infinite from a wall without length."""
    return float(distances_to_wall(wall, np.array([point]))[0])


def distances_to_wall(wall: Wall, points: np.ndarray) -> np.ndarray:
    """Return the distances (k,) of points (k, 2) likewise."""
    length = math.dist(wall.start, wall.end)
    if length == 0:
        return np.full(len(points), math.inf)
    start, end = np.array(wall.start), np.array(wall.end)
    (tx, ty), (x, y) = (end - start) / length, (points - (start + end) / 2).T
    along, across = np.abs(x * tx + y * ty), np.abs(y * tx - x * ty)
    return np.hypot(np.maximum(along - length / 2, 0.0), np.maximum(across - wall.thickness / 2, 0.0))


def distances_to_column(column: Column, points: np.ndarray) -> np.ndarray:
    """Return the distances (k,) of points (k, 2) from a column [m]."""
    return np.maximum(np.hypot(*(points - column.center).T) - column.radius, 0.0)


def distances_to_prism(prism: Prism, points: np.ndarray) -> np.ndarray:
    """Return the distances (k,) of points (k, 2) from a prism [m]; one whose sides cross has no inside."""
    parts = prism.convex() if is_simple(prism.corners) else (prism,)
    return np.min([_from_convex(np.array(part.corners), points) for part in parts], axis=0)


def _from_convex(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the distances (k,) of points (k, 2) from a convex polygon (c, 2) [m]."""
    side, offset = np.roll(corners, -1, axis=0) - corners, points[:, None] - corners  # (c, 2), (k, c, 2)
    turn = side[:, 0] * offset[..., 1] - side[:, 1] * offset[..., 0]
    within = (turn >= 0).all(axis=1) | (turn <= 0).all(axis=1)
    share = np.sum(offset * side, axis=-1) / np.maximum(np.sum(side**2, axis=1), 1e-300)
    apart = offset - np.clip(share, 0.0, 1.0)[..., None] * side
    return np.where(within, 0.0, np.hypot(apart[..., 0], apart[..., 1]).min(axis=1))
