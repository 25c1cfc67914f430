"""Footprints of walls in the plane, and distances of points from them; poses of bodies from their hand points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Wall


class Rectangles(NamedTuple):
    """Footprints of w walls: rectangles along their own axis."""

    centre: np.ndarray  # (w, 2) [m]
    axis: np.ndarray  # (w, 2) unit vector along the wall
    half_size: np.ndarray  # (w, 2) half the length, half the thickness [m]


def body_pose(hand_world: np.ndarray, heading: np.ndarray, hand_offset: float) -> np.ndarray:
    """Return the poses (..., 3) x, y [m], heading [rad] of bodies whose hand points (..., 2) are there."""
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.concatenate([hand_world - hand_offset * ahead, np.asarray(heading)[..., None]], axis=-1)


def wall_rectangles(walls: Sequence[Wall]) -> Rectangles:
    """Return the footprints of `walls`, in their order."""
    start = np.array([wall.start for wall in walls], dtype=float).reshape(-1, 2)
    end = np.array([wall.end for wall in walls], dtype=float).reshape(-1, 2)
    length = np.linalg.norm(end - start, axis=1)
    thickness = np.array([wall.thickness for wall in walls], dtype=float)
    return Rectangles(
        centre=(start + end) / 2,
        axis=(end - start) / length[:, None],
        half_size=np.column_stack([length, thickness]) / 2,
    )


def signed_distance(points: np.ndarray, walls: Rectangles) -> np.ndarray:
    """Return the distances (k, w) [m] of points (k, 2) from each wall's nearest face; negative inside the wall."""
    offset = points[:, None, :] - walls.centre  # (k, w, 2)
    along = np.abs(np.einsum("kwd,wd->kw", offset, walls.axis))
    across = np.abs(offset[..., 1] * walls.axis[:, 0] - offset[..., 0] * walls.axis[:, 1])
    beyond = np.stack([along, across], axis=-1) - walls.half_size
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    inside = np.minimum(beyond.max(axis=-1), 0.0)
    return outside + inside


def wall_margin(hand_world: np.ndarray, walls: Rectangles, clearance: float) -> np.ndarray:
    """Return the distance (n,) of hand points (n, 2) from the nearest wall, less `clearance`; inf without walls."""
    return wall_margins(hand_world, tuple(walls), clearance)


@kernel
def wall_margins(points, walls, clearance):
    """Compute what `wall_margin` returns; `walls` is Rectangles as a plain tuple, which costs less to hand over."""
    rectangles = Rectangles(*walls)
    margins = np.empty(len(points))
    for k in range(len(points)):
        margins[k] = margin(points[k, 0], points[k, 1], rectangles, clearance)
    return margins


@kernel
def margin(point_x, point_y, walls, clearance):
    """Return the margin of one point to the nearest of the Rectangles `walls`."""
    centre, axis, half_size = walls.centre, walls.axis, walls.half_size
    nearest = np.inf
    for w in range(len(centre)):
        x, y = point_x - centre[w, 0], point_y - centre[w, 1]
        along = abs(x * axis[w, 0] + y * axis[w, 1]) - half_size[w, 0]
        across = abs(y * axis[w, 0] - x * axis[w, 1]) - half_size[w, 1]
        outside = math.sqrt(max(along, 0.0) ** 2 + max(across, 0.0) ** 2)
        nearest = min(nearest, outside + min(max(along, across), 0.0))
    return nearest - clearance
