"""Primitives of Foxglove's scene schemas, and the colours of things."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Any

Color = tuple[float, float, float, float]

WALL_COLOR: Color = (0.45, 0.45, 0.5, 1.0)
FLOOR_COLOR: Color = (0.92, 0.92, 0.9, 1.0)
PATCH_COLOR: Color = (0.72, 0.68, 0.6, 1.0)
STOP_COLOR: Color = (0.8, 0.52, 0.16, 0.5)
MOVING_COLOR: Color = (0.8, 0.52, 0.16, 1.0)
NOSE_COLOR: Color = (0.97, 0.97, 0.94, 1.0)
OPERATOR_COLOR: Color = (0.85, 0.1, 0.1, 1.0)
OPTIMUM_COLOR: Color = (0.0, 0.0, 0.0, 1.0)
# Okabe and Ito's palette, told apart by colour-blind readers.
_ROBOTS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0))


def robot_color(robot: int) -> Color:
    """Return the colour of robot `robot`, counted from 0."""
    red, green, blue = _ROBOTS[robot % len(_ROBOTS)]
    return (red / 255, green / 255, blue / 255, 1.0)


def paint(target: Any, color: Color) -> None:
    """Set the red, green, blue and alpha of a message's colour."""
    target.r, target.g, target.b, target.a = color


def box(entity: Any, middle: Sequence[float], heading: float, size: Sequence[float], color: Color) -> None:
    """Add a box; `middle` (3,) [m], `heading` [rad] about z, `size` (3,) [m]."""
    _solid(entity.cubes.add(), middle, heading, size, color)


def ball(entity: Any, middle: Sequence[float], diameter: float, color: Color) -> None:
    """Add a ball; `middle` (3,) [m]."""
    _solid(entity.spheres.add(), middle, 0.0, (diameter,) * 3, color)


def disc(entity: Any, middle: Sequence[float], size: Sequence[float], color: Color) -> None:
    """Add a cylinder that stands upright; `middle` (3,) [m], `size` (3,) [m]."""
    cylinder = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
    _solid(cylinder, middle, 0.0, size, color)


def segments(entity: Any, points: Sequence[Sequence[float]], width: float, color: Color) -> None:
    """Join points (2 S, 2 or 3) [m] pairwise by lines, `width` [pixel]; nothing for no points."""
    if not points:
        return
    line = entity.lines.add(type=2, thickness=width, scale_invariant=True)  # LINE_LIST
    line.pose.orientation.w = 1.0
    paint(line.color, color)
    for x, y, z in points:
        line.points.add(x=x, y=y, z=z)


def _solid(solid: Any, middle: Sequence[float], heading: float, size: Sequence[float], color: Color) -> None:
    for target, values in ((solid.pose.position, middle), (solid.size, size)):
        target.x, target.y, target.z = values
    solid.pose.orientation.z, solid.pose.orientation.w = sin(heading / 2), cos(heading / 2)
    paint(solid.color, color)
