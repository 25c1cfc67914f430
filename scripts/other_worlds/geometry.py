"""Polygons (k, 2) of corners [m], counter-clockwise or not."""

from __future__ import annotations

import numpy as np


def rectangle(center: np.ndarray, size: np.ndarray, angle: float) -> np.ndarray:
    """Return a rectangle's corners (4, 2), its first side at an angle [rad]."""
    return center + turned(0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * size, angle)


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Return points (n, 2) turned by an angle [rad] around the origin."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def regular(center: np.ndarray, radius: float, corners: int = 24) -> np.ndarray:
    return star(center, np.full(corners, radius), np.arange(corners) * 2 * np.pi / corners)


def star(center: np.ndarray, radii: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the corners (k, 2) at radii (k,) [m] and angles (k,) [rad] around a centre."""
    return center + radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def signed_distance(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distance (n,) of points (n, 2) from a polygon's outline, negative inside."""
    a, b = corners[None], np.roll(corners, -1, axis=0)[None]
    side, to = b - a, points[:, None] - a
    share = np.clip((to * side).sum(-1) / np.maximum((side**2).sum(-1), 1e-12), 0.0, 1.0)
    distance = np.linalg.norm(to - share[..., None] * side, axis=-1).min(axis=1)
    crosses = (a[..., 1] > points[:, None, 1]) != (b[..., 1] > points[:, None, 1])
    rise = np.where(side[..., 1] == 0.0, 1.0, side[..., 1])
    left = points[:, None, 0] < a[..., 0] + side[..., 0] * to[..., 1] / rise
    return np.where((crosses & left).sum(axis=1) % 2 == 1, -distance, distance)


def outline(corners: np.ndarray, step: float = 0.03) -> np.ndarray:
    """Return points (n, 2) along a polygon's sides, no farther than a step apart [m]."""
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    counts = ((a, b, int(np.linalg.norm(b - a) / step) + 1) for a, b in sides)
    return np.concatenate([a + (b - a) * np.arange(count)[:, None] / count for a, b, count in counts])


def nearer_than(gap: float, one: np.ndarray, other: np.ndarray) -> bool:
    """Tell whether two polygons overlap or come nearer than a gap [m] to each other."""
    return min(signed_distance(outline(one), other).min(), signed_distance(outline(other), one).min()) < gap
