"""Where in its view a cone's echo comes from, when it comes from a straight wall.

A cone tells the range of what is nearest in its view, w to either side of its axis. Of a wall with the normal theta and
the distance c that is where the edge of the view that is nearer to the normal meets it, or the wall's foot where that
is in view:

    r = c / cos(max(|alpha - theta| - w, 0)),    alpha the direction of the axis.

So a cone is a ray from the axis turned towards the normal by w, or onto it (the region of constant depth of a sonar:
Leonard and Durrant-Whyte, "Directed Sonar Sensing for Mobile Robot Navigation", 1992), and all that is told of rays
holds for that one. The turn depends on the line asked about. A ray, of w = 0, is not turned.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

X, Y, R, DX, DY, VARIANCE = range(6)  # columns of `points`


@kernel
def ray(points, half_cone, b, nx, ny):
    """Return the direction (x, y) in which beam b meets a wall of normal (nx, ny), and where its echo then is [m]."""
    if half_cone > 0.0:
        return _turned(points, half_cone, b, nx, ny)
    return points[b, DX], points[b, DY], points[b, X], points[b, Y]


@kernel
def displacement(points, half_cone, beams, nx, ny):
    """Return the way (x, y) from the echo of one of two `beams` (2,) to that of the other [m], both of such a wall."""
    _, _, ax, ay = ray(points, half_cone, beams[0], nx, ny)
    _, _, bx, by = ray(points, half_cone, beams[1], nx, ny)
    return bx - ax, by - ay


@kernel
def _turned(points, half_cone, b, nx, ny):
    """Return the same of a cone."""
    dx, dy, r, cos, sin = points[b, DX], points[b, DY], points[b, R], math.cos(half_cone), math.sin(half_cone)
    if dx * nx + dy * ny >= cos:
        return nx, ny, r * nx, r * ny
    if dx * ny - dy * nx < 0.0:
        sin = -sin
    tx, ty = cos * dx - sin * dy, sin * dx + cos * dy
    return tx, ty, r * tx, r * ty


@kernel
def chord_normal(points, half_cone, a, z):
    """Return (n_x, n_y, length) of the chord a-z; n points away from the robot when z follows a counter-clockwise."""
    if half_cone > 0.0:
        return _wall_of_two(points, half_cone, a, z)
    x, y = points[z, X] - points[a, X], points[z, Y] - points[a, Y]
    length = math.sqrt(x * x + y * y)
    return (y / length, -x / length, length) if length > 0.0 else (0.0, 0.0, 0.0)


@kernel
def _wall_of_two(points, half_cone, a, z):
    """Return (n_x, n_y, length) of the wall that cones a and z see."""
    theta = math.atan2(points[a, DY], points[a, DX]) + _normal_of_two(points, half_cone, a, z)
    nx, ny = math.cos(theta), math.sin(theta)
    x, y = displacement(points, half_cone, (a, z), nx, ny)
    return nx, ny, abs(nx * y - ny * x)


@kernel
def _normal_of_two(points, half_cone, a, z):
    """Return the direction of the normal of the wall that cones a and z see, from the axis of a on [rad].

    The wall's foot is before both views, behind both, between them, or in one of them: then that cone tells how far the
    wall is, and the other one how it is turned. Of what is in both views any wall between may be; it is one that leaves
    the edge of a view.
    """
    sine = points[a, DX] * points[z, DY] - points[a, DY] * points[z, DX]
    angle, w = math.atan2(sine, points[a, DX] * points[z, DX] + points[a, DY] * points[z, DY]), half_cone
    near, far = points[a, R], points[z, R]
    foot = _foot(near, 0.0, far, angle)
    if angle < 0.0:  # half a turn apart, or more: no wall is seen so
        return foot
    if foot <= 0.0:
        return foot - w
    if foot >= angle:
        return foot + w
    foot = _foot(near, w, far, angle - w)
    if w <= foot <= angle - w:
        return foot
    if near <= far:
        return angle - w - math.acos(near / far)
    return w + math.acos(far / near)


@kernel
def _foot(near, first, far, second):
    """Return the direction of the normal of the line through places at two ranges [m] and directions [rad]."""
    x = far * math.cos(second) - near * math.cos(first)
    y = far * math.sin(second) - near * math.sin(first)
    return math.atan2(-x, y)
