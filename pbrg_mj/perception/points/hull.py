"""The gap between the convex hull of points and a segment.

The algorithm of Gilbert, Johnson and Keerthi (IEEE Journal of Robotics and Automation 4(2), 1988), in the plane.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

MOST_STEPS = 50
EXACT = 1e-9  # [m] of the gap


@kernel
def distance_to_hull(xs, ys, size, path):
    """Return the gap [m] between the hull of points and the segment `path` (4,), and the vector across it.

    The points are the first `size` of xs and ys [m], one at least. The vector (x, y) [m] is the shortest from the
    segment to the hull. The gap is 0 where they meet.
    """
    ax, ay = _farthest(xs, ys, size, path, 1.0, 0.0)
    bx, by, vx, vy = ax, ay, ax, ay
    for _ in range(MOST_STEPS):
        length = math.sqrt(vx * vx + vy * vy)
        if length <= EXACT:
            return 0.0, 0.0, 0.0
        wx, wy = _farthest(xs, ys, size, path, vx, vy)
        if length - (wx * vx + wy * vy) / length <= EXACT:
            return length, vx, vy
        if _holds_origin(ax, ay, bx, by, wx, wy):
            return 0.0, 0.0, 0.0
        fx, fy = _nearest_to_origin(ax, ay, wx, wy)
        gx, gy = _nearest_to_origin(bx, by, wx, wy)
        if fx * fx + fy * fy <= gx * gx + gy * gy:
            bx, by, vx, vy = wx, wy, fx, fy
        else:
            ax, ay, vx, vy = wx, wy, gx, gy
    return math.sqrt(vx * vx + vy * vy), vx, vy


@kernel
def _farthest(xs, ys, size, path, vx, vy):
    """Return the point of hull minus segment that is farthest against (vx, vy); xs, ys (size or more,) [m]."""
    least, first = math.inf, 0
    for i in range(size):
        along = vx * xs[i] + vy * ys[i]
        if along < least:
            least, first = along, i
    if vx * path[0] + vy * path[1] > vx * path[2] + vy * path[3]:
        return xs[first] - path[0], ys[first] - path[1]
    return xs[first] - path[2], ys[first] - path[3]


@kernel
def _holds_origin(ax, ay, bx, by, cx, cy):
    """Tell whether the origin is inside of a triangle."""
    ab, bc, ca = ax * by - ay * bx, bx * cy - by * cx, cx * ay - cy * ax
    return (ab > 0.0 and bc > 0.0 and ca > 0.0) or (ab < 0.0 and bc < 0.0 and ca < 0.0)


@kernel
def _nearest_to_origin(ax, ay, bx, by):
    """Return the point of a segment that is nearest to the origin."""
    dx, dy = bx - ax, by - ay
    squared = dx * dx + dy * dy
    share = 0.0 if squared == 0.0 else min(max(-(ax * dx + ay * dy) / squared, 0.0), 1.0)
    return ax + share * dx, ay + share * dy
