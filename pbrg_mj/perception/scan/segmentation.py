"""Segmentation of a scan: points to clusters, and every cluster to straight segments.

A cluster is a run of points that may lie on one surface (adaptive breakpoints). Split and merge cuts it into segments.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.points import BLOCKED, R, X, Y, apart, chord_error, chord_normal


@kernel
def clusters_into(points, rules, order, count, turned, stops, breaks):  # pragma: no cover - compiled
    """Write the points turned so that no cluster wraps, and where each cluster stops; return (clusters, ring).

    `breaks` (B,) is scratch.

    In a ring no neighbours are apart: everything around is one cluster, whose last point is next to its first. It is
    then cut at the point farthest away, which is a corner if there is any.
    """
    first, ring = _first(points, rules, order, count, breaks)
    clusters = 0
    for i in range(count):
        k = first + i if first + i < count else first + i - count
        turned[i] = order[k]
        if i == count - 1 or breaks[k]:
            stops[clusters] = i + 1
            clusters += 1
    return clusters, ring


@kernel
def _first(points, rules, order, count, breaks):  # pragma: no cover - compiled
    """Return where to begin, and whether the points form a ring; write to `breaks` after which points it is broken."""
    first = farthest = -1
    for i in range(count):
        after = i + 1 if i + 1 < count else 0
        breaks[i] = _broken(points, rules, order, i, after)
        if breaks[i]:
            first = after
        if farthest < 0 or points[order[i], R] > points[order[farthest], R]:
            farthest = i
    return (first, False) if first >= 0 else (farthest, True)


@kernel
def _broken(points, rules, order, i, after):  # pragma: no cover - compiled
    """Tell whether the i-th point and the one after it are apart.

    Lone outliers taken out in between do not count if they are nearer: then they hide the surface, as does the robot
    itself. A beam that went farther, like one that returned nothing, did not meet it.
    """
    a, z = order[i], order[after]
    nearer = 0
    for k in range(a + 1, z if z >= a else z + len(points)):
        if points[k if k < len(points) else k - len(points), R] < max(points[a, R], points[z, R]):
            nearer += 1
    return apart(points, rules, a, z, nearer)


MIN_TURN, MAX_TURN = math.radians(5.0), math.radians(40.0)  # between the pieces of one curved surface


@kernel
def pieces_into(points, rules, order, clusters, work):  # pragma: no cover - compiled
    """Write the pieces (start, stop, cluster) of all clusters, in order; return how many there are.

    No point of a piece is farther than allowed from the chord between the piece's ends.
    """
    pieces = start = 0
    for cluster in range(clusters):
        stop = work.stops[cluster]
        pieces = _split(points, rules, order, (start, stop, cluster), pieces, work)
        start = stop
    return pieces


@kernel
def _split(points, rules, order, whole, pieces, work):  # pragma: no cover - compiled
    """Cut at the point farthest from the chord until none is too far (iterative end point fit)."""
    start, stop, cluster = whole
    first = pieces
    stack, size = work.stack, 1
    stack[0, 0], stack[0, 1] = start, stop
    while size > 0:
        size -= 1
        low, high = stack[size, 0], stack[size, 1]
        cut = _cut(points, rules, order, low, high)
        if cut < 0:
            pieces = _merge(points, rules, order, (low, high, cluster), first, pieces, work.pieces)
        else:
            stack[size, 0], stack[size, 1] = cut, high  # the left part is taken first: pieces stay in order
            stack[size + 1, 0], stack[size + 1, 1] = low, cut
            size += 2
    return pieces


@kernel
def _merge(points, rules, order, piece, first, pieces, out):  # pragma: no cover - compiled
    """Append a piece, or join it to the one before if they are straight together; return how many there are.

    A split may leave a wall's last point with the next wall.
    """
    if pieces > first and _cut(points, rules, order, out[pieces - 1, 0], piece[1]) < 0:
        out[pieces - 1, 1] = piece[1]
        return pieces
    out[pieces, 0], out[pieces, 1], out[pieces, 2] = piece
    return pieces + 1


@kernel
def _cut(points, rules, order, low, high):  # pragma: no cover - compiled
    """Return the point of low..high-1 that is farthest from their chord, never an end; -1 if none is too far."""
    worst, cut = 1.0, -1
    ends = (order[low], order[high - 1])
    chord = chord_normal(points, *ends)
    for i in range(low + 1, high - 1):
        error = abs(chord_error(points, rules, ends, chord, order[i]))
        if error > worst:
            worst, cut = error, i
    return cut


@kernel
def without_stub(points, rules, order, piece):  # pragma: no cover - compiled
    """Return where a piece starts and stops without a stub on the far side of beams that the robot itself stops.

    Whether it goes on behind them nobody sees. It does if both sides show half of a wall's least length, more than
    another robot shows; a shorter side may be such a robot.
    """
    start, stop = piece[0], piece[1]
    for i in range(start + 1, stop):
        if _hidden(points, order[i - 1], order[i]):
            if _length(points, order[start], order[i - 1]) < 0.5 * rules.min_length:
                start = i
            elif _length(points, order[i], order[stop - 1]) < 0.5 * rules.min_length:
                return start, i
    return start, stop


@kernel
def _hidden(points, b, after):  # pragma: no cover - compiled
    """Tell whether the robot itself stops a beam between two."""
    hidden = False
    for k in range(1, (after - b) % len(points)):
        hidden = hidden or points[(b + k) % len(points), R] == BLOCKED
    return hidden


@kernel
def _length(points, b, after):  # pragma: no cover - compiled
    return math.hypot(points[after, X] - points[b, X], points[after, Y] - points[b, Y])


@kernel
def is_curved(points, order, pieces, count, ring, i):  # pragma: no cover - compiled
    """Tell whether piece i turns gently the same way into both its neighbours: then it is part of a curve.

    Five points of a circle can pass for a straight line by themselves.
    """
    if count < 3:
        return False
    turn_in = _turn(points, order, pieces, (i - 1) % count, i, ring)
    turn_out = _turn(points, order, pieces, i, (i + 1) % count, ring)
    return turn_in * turn_out > 0.0


@kernel
def _turn(points, order, pieces, i, after, ring):  # pragma: no cover - compiled
    """Return the turn [rad] from one piece to the next if it is gentle, else 0.

    Neighbours of fewer than three points have no direction of their own, those of another cluster do not count.
    """
    if pieces[i, 1] - pieces[i, 0] < 3 or pieces[after, 1] - pieces[after, 0] < 3:
        return 0.0
    if not ring and pieces[i, 2] != pieces[after, 2]:
        return 0.0
    (x0, y0), (x1, y1) = _chord(points, order, pieces[i]), _chord(points, order, pieces[after])
    turn = math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    return turn if MIN_TURN < abs(turn) < MAX_TURN else 0.0


@kernel
def _chord(points, order, piece):  # pragma: no cover - compiled
    low, high = order[piece[0]], order[piece[1] - 1]
    return points[high, X] - points[low, X], points[high, Y] - points[low, Y]
