"""The nearest point to a target that several half-planes allow.

Half-planes are taken in one by one. Where the point found so far violates the next one, the nearest point lies on that
one's edge (the distance is strictly convex), and on the edge the ones before it leave an interval.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

ROUNDING = 1e-9  # [m] by which a point may violate a half-plane
PARALLEL = 1e-12  # sine of the angle between edges that do not meet
BISECTIONS = 40  # of the least violation of what no point keeps: to 1e-12 of where they begin
CONTRADICTORY = 10.0  # edges that meet at less than 11.5 deg: what they allow is that many violations away, or farther


@kernel
def nearest_allowed(target_x, target_y, normals, offsets, slack):
    """Return (found, x, y): the nearest point with `normals @ point <= offsets + slack`.

    `normals` (k, 2) are unit rows, `offsets` (k,) [m]; an infinite offset asks for nothing.
    """
    x, y = target_x, target_y
    for k in range(len(offsets)):
        bound = offsets[k] + slack
        nx, ny = normals[k, 0], normals[k, 1]
        if nx * x + ny * y <= bound:
            continue
        foot_x, foot_y = bound * nx, bound * ny  # the edge is foot + s (-ny, nx)
        low, high = -np.inf, np.inf
        for j in range(k):
            limit = offsets[j] + slack
            if limit == np.inf:
                continue
            mx, my = normals[j, 0], normals[j, 1]
            rest = limit - (mx * foot_x + my * foot_y)
            along = my * nx - mx * ny
            if abs(along) <= PARALLEL:
                if rest < -ROUNDING:
                    return False, x, y
            elif along > 0.0:
                high = min(high, rest / along)
            else:
                low = max(low, rest / along)
        if low > high + ROUNDING:
            return False, x, y
        s = target_y * nx - target_x * ny
        s = min(max(s, low), high)
        x, y = foot_x - s * ny, foot_y + s * nx
    return math.isfinite(x + y), x, y


@kernel
def near_allowed(normals, at_held, at_team, reach):
    """Tell whether half-planes allow the held m, or a point near the team: no farther than `search_radius` says.

    `at_held` and `at_team` (k,) [m] are the offsets as seen from the one and from the other.
    """
    for k in range(len(at_held)):
        if at_held[k] < -ROUNDING:
            found, x, y = nearest_allowed(0.0, 0.0, normals, at_team, 0.0)
            radius = search_radius(at_team, reach)
            return found and x * x + y * y <= radius * radius
    return True


@kernel
def search_radius(offsets, reach):
    """Return how far from 0 a point is looked for [m]: `reach` at most, and `CONTRADICTORY` worst violations at 0.

    `offsets` (R,) [m] are those of half-planes. One edge is met as far away as it is violated, two after that over the
    sine of half the angle at which they meet.
    """
    worst = 0.0
    for k in range(len(offsets)):
        worst = max(worst, -offsets[k])
    return min(reach, CONTRADICTORY * worst)


@kernel
def least_violating(normals, offsets, reach):
    """Return (x, y), the point nearest to 0 among those that violate the worst half-plane least (by bisection).

    Half-planes are normals (R, 2) . x <= offsets (R,) [m]. Only points no farther from 0 than `reach` [m] count, which
    may be infinite.
    """
    worst = 0.0
    for k in range(len(offsets)):
        worst = max(worst, -offsets[k])
    low, high = 0.0, worst
    best_x, best_y = 0.0, 0.0
    for _ in range(BISECTIONS):
        slack = 0.5 * (low + high)
        found, x, y = nearest_allowed(0.0, 0.0, normals, offsets, slack)
        if found and x * x + y * y <= reach * reach:
            high, best_x, best_y = slack, x, y
        else:
            low = slack
    return best_x, best_y
