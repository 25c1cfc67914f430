"""Primitives of Foxglove's scene schemas, and the colours of things."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, sin
from typing import Any

Color = tuple[float, float, float, float]

WALL_COLOR: Color = (0.45, 0.45, 0.5, 1.0)
FLOOR_COLOR: Color = (0.92, 0.92, 0.9, 1.0)
PATCH_COLOR: Color = (0.72, 0.68, 0.6, 1.0)
STOP_COLOR: Color = (0.8, 0.52, 0.16, 0.5)
MOVING_COLOR: Color = (0.8, 0.52, 0.16, 1.0)
HEADING_COLOR: Color = (0.97, 0.97, 0.94, 1.0)
REFERENCE_COLOR: Color = (0.85, 0.1, 0.1, 1.0)
OPTIMUM_COLOR: Color = (0.0, 0.0, 0.0, 1.0)
# The palette of Okabe and Ito, which colour-blind readers can tell apart.
_ROBOT_COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0))


def robot_color(robot: int) -> Color:
    """Return the colour of robot `robot`, counted from 0."""
    red, green, blue = _ROBOT_COLORS[robot % len(_ROBOT_COLORS)]
    return (red / 255, green / 255, blue / 255, 1.0)


def set_color(target: Any, color: Color) -> None:
    """Set the red, green, blue and alpha of a message's colour."""
    target.r, target.g, target.b, target.a = color


def add_box(entity: Any, centre: Sequence[float], heading: float, size: Sequence[float], color: Color) -> None:
    """Add a box; `centre` (3,) [m], `heading` [rad] about z, `size` (3,) [m]."""
    _set_solid(entity.cubes.add(), centre, heading, size, color)


def add_sphere(entity: Any, centre: Sequence[float], diameter: float, color: Color) -> None:
    """Add a sphere; `centre` (3,) [m]."""
    _set_solid(entity.spheres.add(), centre, 0.0, (diameter,) * 3, color)


def add_cylinder(entity: Any, centre: Sequence[float], size: Sequence[float], color: Color) -> None:
    """Add an upright cylinder; `centre` (3,) [m], `size` (3,) [m]."""
    cylinder = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
    _set_solid(cylinder, centre, 0.0, size, color)


def add_prism(entity: Any, corners: Sequence[Sequence[float]], height: float, color: Color) -> None:
    """Add an upright convex prism on the floor; `corners` (k, 2) [m] of its footprint in turn."""
    solid = entity.triangles.add()
    solid.pose.orientation.w = 1.0
    set_color(solid.color, color)
    top = [(*corner, height) for corner in corners]
    sides = [
        triangle
        for (a, b), (c, d) in zip(corners, [*corners[1:], corners[0]], strict=True)
        for triangle in (((a, b, 0.0), (c, d, 0.0), (c, d, height)), ((a, b, 0.0), (c, d, height), (a, b, height)))
    ]
    for triangle in (*((top[0], first, second) for first, second in pairwise(top[1:])), *sides):
        for x, y, z in triangle:
            solid.points.add(x=x, y=y, z=z)


def add_line_segments(entity: Any, points: Sequence[Sequence[float]], width: float, color: Color) -> None:
    """Join points (2 S, 3) [m] pairwise by lines, `width` [pixel]; nothing for no points."""
    if not points:
        return
    line = entity.lines.add(type=2, thickness=width, scale_invariant=True)  # LINE_LIST
    line.pose.orientation.w = 1.0
    set_color(line.color, color)
    for x, y, z in points:
        line.points.add(x=x, y=y, z=z)


def _set_solid(solid: Any, centre: Sequence[float], heading: float, size: Sequence[float], color: Color) -> None:
    for target, values in ((solid.pose.position, centre), (solid.size, size)):
        target.x, target.y, target.z = values
    solid.pose.orientation.z, solid.pose.orientation.w = sin(heading / 2), cos(heading / 2)
    set_color(solid.color, color)
