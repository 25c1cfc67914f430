"""Cones that see the end of a wall.

What is nearest in a view is the end of a wall if the wall's foot is not on it, but beyond that end. The end is farther
than the line is there, so it would turn the line. It is in the views of the last beams on that side: of the last one
always, where views overlap, as the beam after it met no wall. Where that one met something nearer than the line, a wall
that joins this one or one before it, no end is to be seen.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import DX, DY, VARIANCE, R
from pbrg_mj.perception.scan.line_fit import LEAST_COSINE, incidence_cosine

END_ERROR = 0.3  # standard deviations of a range that an end may be farther than the line


@kernel
def drop_near_ends(points, params, members, line):
    """Take out beams that may see an end of their wall; return how many of the `members` (N,) are left, first.

    `line` (2,) is theta, c.
    """
    first = _seeing_end(points, params, members, -1, line)
    final = _seeing_end(points, params, members, 1, line)
    left = max(len(members) - first - final, 0)
    for i in range(left):
        members[i] = members[first + i]
    return left


@kernel
def _seeing_end(points, params, members, outward, line):
    """Return how many beams at one side of a wall, 1 for counter-clockwise or -1, may see an end there."""
    nx, ny, count = math.cos(line[0]), math.sin(line[0]), len(members)
    end = members[0] if outward < 0 else members[count - 1]
    if _is_nearer(points, params, (end + outward) % len(points), line):
        return 0
    nearest = params.half_cone - outward * _turn(points, end, nx, ny)  # at most, from the foot to where it ends
    if not 0.0 < nearest < math.acos(LEAST_COSINE):
        return 0
    seeing = 0
    for i in range(count):
        b = members[i] if outward < 0 else members[count - 1 - i]
        turn = -outward * _turn(points, b, nx, ny)
        if turn - params.half_cone >= nearest:
            break
        farther = line[1] / math.cos(nearest) - line[1] / incidence_cosine(points, params, nx, ny, b)
        if farther > END_ERROR * math.sqrt(points[b, VARIANCE]):
            seeing = i + 1
    return seeing


@kernel
def _is_nearer(points, params, b, line):
    """Tell whether a beam met something nearer than a line."""
    cosine = incidence_cosine(points, params, math.cos(line[0]), math.sin(line[0]), b)
    return math.isfinite(points[b, R]) and points[b, R] * max(cosine, 0.0) < line[1]


@kernel
def _turn(points, b, nx, ny):
    """Return the angle from a normal to the axis of a beam, counter-clockwise [rad]."""
    return math.atan2(nx * points[b, DY] - ny * points[b, DX], nx * points[b, DX] + ny * points[b, DY])
