"""Convex hulls and the widest gap between two of them."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

ROUNDING = 1e-9  # relative and absolute


def hull(points: np.ndarray) -> np.ndarray:
    """Return the indices of the corners of the convex hull of points (N, 2), counter-clockwise, N >= 1.

    Andrew's monotone chain; one or two indices when the points are one or on a line.
    """
    count = len(points)
    order = np.empty(count, np.int64)
    for i in range(count):  # insertion sort by x, then y
        k, j = i, i
        while j > 0 and (
            points[order[j - 1], 0] > points[k, 0]
            or (points[order[j - 1], 0] == points[k, 0] and points[order[j - 1], 1] > points[k, 1])
        ):
            order[j] = order[j - 1]
            j -= 1
        order[j] = k
    chain = np.zeros(2 * count + 1, np.int64)
    size = 0
    for half in range(2):
        floor = size + 1
        for i in range(count):
            k = order[i] if half == 0 else order[count - 1 - i]
            while size > floor:
                a, b = chain[size - 2], chain[size - 1]
                ax, ay = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
                if ax * (points[k, 1] - points[a, 1]) - ay * (points[k, 0] - points[a, 0]) > 0:  # a turn to the left
                    break
                size -= 1
            chain[size] = k
            size += 1
        size -= 1  # the last point begins the other half
    first, last = order[0], order[count - 1]
    one = points[first, 0] == points[last, 0] and points[first, 1] == points[last, 1]
    return chain[: 1 if one else max(size, 1)]


compiled_hull = kernel(hull)  # for kernels; what needs one hull only need not wait for the compiler


@kernel
def gap(team, solid):
    """Return the widest strip between two convex polygons, team (k, 2) and solid (m, 2), corners counter-clockwise [m].

    Its normal gx, gy from team to solid, its width, and the corners i, j of the solid it rests on: j == i for a corner
    alone. The width is -1 when they overlap.
    """
    best, gx, gy, first, second = math.inf, 0.0, 0.0, 0, 0
    for i in range(len(solid)):
        j = (i + 1) % len(solid)
        for k in range(len(team)):
            x, y, inside = _to_edge(solid, i, j, team, k)
            d = x * x + y * y
            if d < best and d > 0:
                best, gx, gy, first, second = d, -x, -y, i, j if inside == 0 else i
                if inside > 0:
                    first = second = j
    for k in range(len(team)):
        after = (k + 1) % len(team)
        for i in range(len(solid)):
            x, y, inside = _to_edge(team, k, after, solid, i)
            d = x * x + y * y
            if d < best * (1 - ROUNDING) and d > 0 and inside == 0:
                best, gx, gy, first, second = d, x, y, i, i
    width = math.sqrt(best)
    gx, gy = gx / width, gy / width
    least, most = math.inf, -math.inf
    for i in range(len(solid)):
        least = min(least, gx * solid[i, 0] + gy * solid[i, 1])
    for k in range(len(team)):
        most = max(most, gx * team[k, 0] + gy * team[k, 1])
    clear = least - most > width - ROUNDING * (1 + abs(least))
    return gx, gy, width if clear else -1.0, first, second


@kernel
def _to_edge(corners, a, b, points, p):
    """Return the way x, y from the nearest point of edge a-b to point p, and which part of it: -1 a, 0 between, 1 b.

    The edge is one of corners (k, 2), the point one of points (m, 2) [m].
    """
    ex, ey = corners[b, 0] - corners[a, 0], corners[b, 1] - corners[a, 1]
    px, py = points[p, 0] - corners[a, 0], points[p, 1] - corners[a, 1]
    square = ex * ex + ey * ey
    u = (px * ex + py * ey) / square if square > 0 else 0.0
    if u <= 0:
        return px, py, -1
    if u >= 1:
        return points[p, 0] - corners[b, 0], points[p, 1] - corners[b, 1], 1
    across = (ex * py - ey * px) / square
    return -ey * across, ex * across, 0
