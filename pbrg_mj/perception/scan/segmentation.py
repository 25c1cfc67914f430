"""Segmentation of a scan: points to clusters, and every cluster to straight segments.

A cluster is a run of points that may lie on one surface (adaptive breakpoints). Split and merge cuts it into segments.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import chord_normal
from pbrg_mj.perception.scan.points import BLOCKED, R, X, Y, apart, chord_error


@kernel
def write_clusters(points, params, order, count, turned, stops, breaks):
    """Write the points turned so that no cluster wraps, and where each cluster stops; return (clusters, ring).

    turned (B,) is an `order`, stops (B,) are places in it, `breaks` (B,) is scratch.

    In a ring no neighbours are apart: everything around is one cluster, whose last point is next to its first. It is
    then cut at the point farthest away, which is a corner if there is any.
    """
    first, ring = _first(points, params, order, count, breaks)
    clusters = 0
    for i in range(count):
        k = first + i if first + i < count else first + i - count
        turned[i] = order[k]
        if i == count - 1 or breaks[k]:
            stops[clusters] = i + 1
            clusters += 1
    return clusters, ring


@kernel
def _first(points, params, order, count, breaks):
    """Return where to begin, and whether the points form a ring; write to `breaks` after which points it is broken."""
    first = farthest = -1
    for i in range(count):
        after = i + 1 if i + 1 < count else 0
        breaks[i] = _broken(points, params, order, i, after)
        if breaks[i]:
            first = after
        if farthest < 0 or points[order[i], R] > points[order[farthest], R]:
            farthest = i
    return (first, False) if first >= 0 else (farthest, True)


@kernel
def _broken(points, params, order, i, after):
    """Tell whether the i-th point and the one after it are apart.

    Lone outliers taken out in between do not count if they are nearer: then they hide the surface, as does the robot
    itself. A beam that went farther, like one that returned nothing, did not meet it.
    """
    a, z = order[i], order[after]
    nearer = 0
    for k in range(a + 1, z if z >= a else z + len(points)):
        if points[k if k < len(points) else k - len(points), R] < max(points[a, R], points[z, R]):
            nearer += 1
    return apart(points, params, a, z, nearer)


@kernel
def write_segments(points, params, order, clusters, work):
    """Write the segments (start, stop, cluster) of all clusters, in order; return how many there are.

    No point of a segment is farther than allowed from the chord between the segment's ends.
    """
    segments = start = 0
    for cluster in range(clusters):
        stop = work.stops[cluster]
        segments = _split(points, params, order, (start, stop, cluster), segments, work)
        start = stop
    return segments


@kernel
def _split(points, params, order, whole, segments, work):
    """Cut at the point farthest from the chord until none is too far (iterative end point fit)."""
    start, stop, cluster = whole
    first = segments
    stack, size = work.stack, 1
    stack[0, 0], stack[0, 1] = start, stop
    while size > 0:
        size -= 1
        low, high = stack[size, 0], stack[size, 1]
        cut = _split_point(points, params, order, low, high)
        if cut < 0:
            segments = _merge(points, params, order, (low, high, cluster), first, segments, work.segments)
        else:
            stack[size, 0], stack[size, 1] = cut, high  # the left part is taken first: segments stay in order
            stack[size + 1, 0], stack[size + 1, 1] = low, cut
            size += 2
    return segments


@kernel
def _merge(points, params, order, segment, first, segments, out):
    """Append a segment to `out` (B, 3), or merge it with the one before if they are straight together.

    Return how many there are.
    """
    if segments > first and _split_point(points, params, order, out[segments - 1, 0], segment[1]) < 0:
        out[segments - 1, 1] = segment[1]
        return segments
    out[segments, 0], out[segments, 1], out[segments, 2] = segment
    return segments + 1


@kernel
def _split_point(points, params, order, low, high):
    """Return the point of low..high-1 that is farthest from their chord, never an end; -1 if none is too far."""
    worst, cut = 1.0, -1
    ends = (order[low], order[high - 1])
    chord = chord_normal(points, params.half_cone, *ends)
    for i in range(low + 1, high - 1):
        error = abs(chord_error(points, params, ends, chord, order[i]))
        if error > worst:
            worst, cut = error, i
    return cut


@kernel
def trim_stub(points, params, order, segment):
    """Return where a segment starts and stops without a stub on the far side of beams that the robot itself stops.

    Whether it goes on behind them nobody sees. It does if both sides show half of a line's least length, more than
    another robot shows; a shorter side may be such a robot.
    """
    start, stop = segment[0], segment[1]
    for i in range(start + 1, stop):
        if _hidden(points, order[i - 1], order[i]):
            if _length(points, order[start], order[i - 1]) < 0.5 * params.min_length:
                start = i
            elif _length(points, order[i], order[stop - 1]) < 0.5 * params.min_length:
                return start, i
    return start, stop


@kernel
def _hidden(points, b, after):
    """Tell whether the robot itself stops a beam between two."""
    hidden = False
    for k in range(1, (after - b) % len(points)):
        hidden = hidden or points[(b + k) % len(points), R] == BLOCKED
    return hidden


@kernel
def _length(points, b, after):
    return math.hypot(points[after, X] - points[b, X], points[after, Y] - points[b, Y])


@kernel
def is_curved(points, params, order, segments, count, ring, i):
    """Tell whether segment i turns gently the same way into both its neighbours: then it is part of a curve.

    Five points of a circle can pass for a straight line by themselves.
    """
    if count < 3:
        return False
    turn_in = _turn(points, params, order, segments, (i - 1) % count, i, ring)
    turn_out = _turn(points, params, order, segments, i, (i + 1) % count, ring)
    return turn_in * turn_out > 0.0


@kernel
def _turn(points, params, order, segments, i, after, ring):
    """Return the turn [rad] from one segment to the next if it is gentle, else 0.

    Neighbours of fewer than three points have no direction of their own, those of another cluster do not count.
    """
    if segments[i, 1] - segments[i, 0] < 3 or segments[after, 1] - segments[after, 0] < 3:
        return 0.0
    if not ring and segments[i, 2] != segments[after, 2]:
        return 0.0
    (x0, y0), (x1, y1) = _chord(points, params, order, segments[i]), _chord(points, params, order, segments[after])
    turn = math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    return turn if params.least_curve < abs(turn) < params.most_curve else 0.0


@kernel
def _chord(points, params, order, segment):
    low, high = order[segment[0]], order[segment[1] - 1]
    if params.half_cone > 0.0:
        nx, ny, _ = chord_normal(points, params.half_cone, low, high)
        return -ny, nx
    return points[high, X] - points[low, X], points[high, Y] - points[low, Y]
