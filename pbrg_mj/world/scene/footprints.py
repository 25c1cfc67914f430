"""Footprints of obstacles in the plane, and distances of points from them; poses of bodies from their hand points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Column, Prism, Wall, World


class Footprints(NamedTuple):
    """Footprints of w rectangles along their own axis, rounded by a radius, and of k convex polygons."""

    centre: np.ndarray  # (w, 2) [m]
    axis: np.ndarray  # (w, 2) unit vector along the rectangle
    half_size: np.ndarray  # (w, 2) half the length, half the thickness [m]; 0 of a column
    radius: np.ndarray  # (w,) of a column; 0 of a rectangle [m]
    corners: np.ndarray  # (c, 2) of all polygons, one after the other, each counter-clockwise [m]
    first: np.ndarray  # (k + 1,) where each polygon's corners begin, and where the last one's end

    def polygon(self, k: int) -> np.ndarray:
        """Return the corners of a polygon, counted from 0."""
        return self.corners[self.first[k] : self.first[k + 1]]


def body_pose(hand_world: np.ndarray, heading: np.ndarray, hand_offset: float) -> np.ndarray:
    """Return the poses (..., 3) x, y [m], heading [rad] of bodies whose hand points (..., 2) are there."""
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.concatenate([hand_world - hand_offset * ahead, np.asarray(heading)[..., None]], axis=-1)


def footprints_of(
    walls: Sequence[Wall] = (), columns: Sequence[Column] = (), prisms: Sequence[Prism] = ()
) -> Footprints:
    """Return the footprints of walls, columns and prisms' convex parts, in their order.

    Inside a prism with notches distances are those from the edges of the part that is nearest, or deepest.
    """
    start = np.array([wall.start for wall in walls], dtype=float).reshape(-1, 2)
    end = np.array([wall.end for wall in walls], dtype=float).reshape(-1, 2)
    length = np.linalg.norm(end - start, axis=1)
    thickness = np.array([wall.thickness for wall in walls], dtype=float)
    middle = np.array([column.center for column in columns], dtype=float).reshape(-1, 2)
    parts = (part for prism in prisms for part in prism.convex())
    polygons = [counter_clockwise(np.array(part.corners, dtype=float)) for part in parts]
    return Footprints(
        centre=np.concatenate([(start + end) / 2, middle]),
        axis=np.concatenate([(end - start) / length[:, None], np.tile([1.0, 0.0], (len(columns), 1))]),
        half_size=np.concatenate([np.column_stack([length, thickness]) / 2, np.zeros((len(columns), 2))]),
        radius=np.array([*np.zeros(len(walls)), *(column.radius for column in columns)]),
        corners=np.concatenate([np.zeros((0, 2)), *polygons]),
        first=np.cumsum([0, *map(len, polygons)]),
    )


def world_footprints(world: World) -> Footprints:
    """Return the footprints of all that stands still: walls, boxes, columns, prisms."""
    return footprints_of(world.obstacles, world.columns, world.prisms)


def counter_clockwise(corners: np.ndarray) -> np.ndarray:
    """Return the corners (k, 2) of a polygon counter-clockwise."""
    x, y = corners.T
    return corners if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0 else corners[::-1].copy()


def edges(polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of a counter-clockwise polygon (k, 2) as outward unit normals (k, 2) and offsets (k,) [m]."""
    along = np.roll(polygon, -1, axis=0) - polygon
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    return outward, np.sum(outward * polygon, axis=1)


def least_along(direction: np.ndarray, footprints: Footprints) -> np.ndarray:
    """Return the least direction.q (w + k,) [m] over each footprint, for a unit vector (2,)."""
    across = np.column_stack([-footprints.axis[:, 1], footprints.axis[:, 0]])
    half = footprints.half_size
    reach = half[:, 0] * np.abs(footprints.axis @ direction) + half[:, 1] * np.abs(across @ direction)
    polygons = [(footprints.polygon(k) @ direction).min() for k in range(len(footprints.first) - 1)]
    return np.concatenate([footprints.centre @ direction - reach - footprints.radius, polygons])


def signed_distance(points: np.ndarray, footprints: Footprints) -> np.ndarray:
    """Return the distances (m, w + k) [m] of points (m, 2) from each footprint's edge; negative inside."""
    offset = points[:, None, :] - footprints.centre  # (m, w, 2)
    along = np.abs(np.einsum("kwd,wd->kw", offset, footprints.axis))
    across = np.abs(offset[..., 1] * footprints.axis[:, 0] - offset[..., 0] * footprints.axis[:, 1])
    beyond = np.stack([along, across], axis=-1) - footprints.half_size
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    inside = np.minimum(beyond.max(axis=-1), 0.0)
    polygons = [_from_polygon(points, footprints.polygon(k)) for k in range(len(footprints.first) - 1)]
    return np.column_stack([outside + inside - footprints.radius, *polygons])


def _from_polygon(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Return the signed distances (m,) [m] of points (m, 2) from a convex polygon (k, 2), counter-clockwise."""
    outward, offset = edges(polygon)
    inside = (points @ outward.T - offset).max(axis=1)
    side = np.roll(polygon, -1, axis=0) - polygon
    share = np.einsum("mkd,kd->mk", points[:, None] - polygon, side) / np.sum(side**2, axis=1)
    nearest = polygon + np.clip(share, 0.0, 1.0)[..., None] * side
    return np.where(inside <= 0.0, inside, np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1))


def wall_margin(hand_world: np.ndarray, walls: Footprints, clearance: float) -> np.ndarray:
    """Return the distance (n,) of hand points (n, 2) from the nearest footprint, less `clearance`; inf without any."""
    return wall_margins(hand_world, tuple(walls), clearance)


@kernel
def wall_margins(points, walls, clearance):
    """Compute what `wall_margin` returns of points (N, 2) [m].

    `walls` is Footprints as a plain tuple, which costs less to hand over.
    """
    footprints = Footprints(*walls)
    margins = np.empty(len(points))
    for k in range(len(points)):
        margins[k] = margin(points[k, 0], points[k, 1], footprints, clearance)
    return margins


@kernel
def margin(point_x, point_y, walls, clearance):
    """Return the margin of one point to the nearest of the Footprints `walls`."""
    centre, axis, half_size, radius = walls.centre, walls.axis, walls.half_size, walls.radius
    nearest = np.inf
    for w in range(len(centre)):
        x, y = point_x - centre[w, 0], point_y - centre[w, 1]
        along = abs(x * axis[w, 0] + y * axis[w, 1]) - half_size[w, 0]
        across = abs(y * axis[w, 0] - x * axis[w, 1]) - half_size[w, 1]
        outside = math.sqrt(max(along, 0.0) ** 2 + max(across, 0.0) ** 2)
        nearest = min(nearest, outside + min(max(along, across), 0.0) - radius[w])
    for k in range(len(walls.first) - 1):
        nearest = min(nearest, _polygon_distance(point_x, point_y, walls.corners, walls.first[k], walls.first[k + 1]))
    return nearest - clearance


@kernel
def _polygon_distance(point_x, point_y, corners, first, last):
    """Return the signed distance of a point from the convex polygon of the corners from `first` to before `last`."""
    inside, outside = -np.inf, np.inf
    for k in range(first, last):
        after = k + 1 if k + 1 < last else first
        side_x, side_y = corners[after, 0] - corners[k, 0], corners[after, 1] - corners[k, 1]
        x, y = point_x - corners[k, 0], point_y - corners[k, 1]
        squared = side_x**2 + side_y**2
        inside = max(inside, (x * side_y - y * side_x) / math.sqrt(squared))
        share = min(max((x * side_x + y * side_y) / squared, 0.0), 1.0)
        outside = min(outside, math.hypot(x - share * side_x, y - share * side_y))
    return inside if inside <= 0.0 else outside
