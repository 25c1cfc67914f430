"""Half-spaces between the way of a hand point to its target and the points of obstacles.

The way is the segment from the hand point q to its target b_i + m_i under the reference that is held, as far as it is
free. Half-spaces follow one another as in safe flight corridors (Liu et al., RA-L 2(3), 2017, with discs in place of
ellipsoids): the point nearest to the way begins a face, all points that the face keeps off are done with, the next
nearest of the others begins the next. A face is the hull of the points in a window around the nearest one, and its
normal that of the widest gap between the hull and the way; the window shrinks until the hull leaves the way most of
the room that its nearest point leaves. Every half-space is moved towards the robot by the clearance and by what its
points may be wrong by.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.hull import gap_to_hull

REACH = 3.0  # [m] farther away from the way nothing is kept off
WINDOWS = (1.0, 0.5, 0.25, 0.1)  # [m] around the nearest point
ROOM = 0.8  # of the distance to the nearest point that its hull must leave to the way
SAME_FACE = math.cos(math.radians(20.0))  # between the normals of one face in two scans
STEADY = 0.01  # [m] of room that may be lost so that a normal does not turn with the noise of every scan


class Seen(NamedTuple):
    """The points that bind and are not kept off yet: the first `count` of each array."""

    x: np.ndarray  # (M,) [m]
    y: np.ndarray  # (M,) [m]
    std: np.ndarray  # (M,) of the range [m]
    inset: np.ndarray  # (M,) how far the hand point must stay from a place known as badly as the robot's pose [m]


@kernel
def separate(points, q, target, parameters, G, h, active):
    """Write half-spaces G (K, 2), h (K,), active (K,) for the hand point q (2,) [m] on its way to `target` (2,) [m].

    On entry they are those of the scan before, whose slots and, where they serve as well, normals are taken over.
    """
    seen, count = _seen(points, parameters)
    window = Seen(np.empty(count), np.empty(count), np.empty(count), np.empty(count))
    way = _free_way(seen, count, q, target, parameters)
    old, was_active, taken = G.copy(), active.copy(), np.zeros(len(h), np.bool_)
    for _ in range(len(h)):
        size, nx, ny = _next_face(seen, count, window, way)
        if size == 0:
            break
        k = _slot((window, size, way), (nx, ny), (old, was_active, taken))
        if was_active[k] and nx * old[k, 0] + ny * old[k, 1] > SAME_FACE:
            nx, ny = old[k, 0], old[k, 1]
        taken[k] = True
        G[k, 0], G[k, 1] = nx, ny
        nearest, h[k] = _offset(window, size, (nx, ny), parameters)
        count = _left(seen, count, (nx, ny), nearest, h[k], parameters)
    for k in range(len(h)):
        active[k] = taken[k]
        if not taken[k]:
            G[k, 0], G[k, 1], h[k] = 0.0, 0.0, 0.0


@kernel
def _seen(points, parameters):
    """Return the points that bind, and how many there are."""
    size = len(points)
    seen, count = Seen(np.empty(size), np.empty(size), np.empty(size), np.empty(size)), 0
    for i in range(size):
        point = points[i]
        if point["live"] == 1 and point["binds"] == 1:
            seen.x[count], seen.y[count], seen.std[count] = point["x"], point["y"], point["std"]
            seen.inset[count] = parameters.clearance + parameters.sigmas * point["pose_std"]
            count += 1
    return seen, count


@kernel
def _free_way(seen, count, q, target, parameters):
    """Return both ends of the way: it ends where it first comes as near to a point as is allowed, or at the target."""
    dx, dy = target[0] - q[0], target[1] - q[1]
    length = math.sqrt(dx * dx + dy * dy)
    if not length > 0.0:
        return q[0], q[1], q[0], q[1]
    dx, dy, free = dx / length, dy / length, length
    for i in range(count):
        x, y = seen.x[i] - q[0], seen.y[i] - q[1]
        inset = seen.inset[i] + parameters.sigmas * seen.std[i]
        along, squared = x * dx + y * dy, x * x + y * y
        across = squared - along * along
        if squared <= inset * inset:  # already nearer: any approach ends at once
            if along > 0.0:
                free = 0.0
        elif along > 0.0 and across < inset * inset:
            free = min(free, along - math.sqrt(inset * inset - across))
    return q[0], q[1], q[0] + free * dx, q[1] + free * dy


@kernel
def _next_face(seen, count, window, way):
    """Write the points of the face nearest to the way to `window`; return how many there are, and its normal."""
    nearest, best, gx, gy = _nearest(seen, count, way)
    if nearest < 0:
        return 0, 0.0, 0.0
    for radius in WINDOWS:
        size = 0
        for i in range(count):
            x, y = seen.x[i] - seen.x[nearest], seen.y[i] - seen.y[nearest]
            if x * x + y * y <= radius * radius:
                _copy(seen, i, window, size)
                size += 1
        gap, x, y = gap_to_hull(window.x, window.y, size, way)
        if gap >= ROOM * best:
            return size, x / gap, y / gap
    _copy(seen, nearest, window, 0)
    return 1, gx, gy


@kernel
def _copy(seen, i, window, place):
    window.x[place], window.y[place] = seen.x[i], seen.y[i]
    window.std[place], window.inset[place] = seen.std[i], seen.inset[i]


@kernel
def _nearest(seen, count, way):
    """Return the point nearest to the way, -1 for none within `REACH`; its distance [m] and the direction to it."""
    ax, ay, bx, by = way
    dx, dy = bx - ax, by - ay
    length, nearest, best = dx * dx + dy * dy, -1, REACH * REACH
    gx, gy = 0.0, 0.0
    for i in range(count):
        x, y = seen.x[i] - ax, seen.y[i] - ay
        share = min(max((x * dx + y * dy) / length, 0.0), 1.0) if length > 0.0 else 0.0
        x, y = x - share * dx, y - share * dy
        squared = x * x + y * y
        if 0.0 < squared < best:
            nearest, best, gx, gy = i, squared, x, y
    distance = math.sqrt(best)
    return nearest, distance, gx / distance, gy / distance


@kernel
def _slot(face, normal, before):
    """Return the slot of the same face in the scan before, if its normal serves as well; else a free one."""
    old, was_active, taken = before
    nx, ny = normal
    room, free = _room(face, nx, ny), -1
    for k in range(len(taken)):
        if taken[k]:
            continue
        if was_active[k] and nx * old[k, 0] + ny * old[k, 1] > SAME_FACE:
            if _room(face, old[k, 0], old[k, 1]) >= room - STEADY:
                return k
        elif free < 0 or (was_active[free] and not was_active[k]):
            free = k
    if free >= 0:
        return free
    for k in range(len(taken)):  # all that are left had the same face, with a normal that no longer serves
        if not taken[k]:
            was_active[k] = False
            return k
    return -1


@kernel
def _room(face, gx, gy):
    """Return how far the points of a face are ahead of the way along a unit vector [m]."""
    window, size, way = face
    ahead = math.inf
    for i in range(size):
        ahead = min(ahead, gx * window.x[i] + gy * window.y[i])
    return ahead - max(gx * way[0] + gy * way[1], gx * way[2] + gy * way[3])


@kernel
def _offset(window, size, normal, parameters):
    """Return where the hand point is at the nearest of a face's points, and h of its half-space [m]."""
    gx, gy = normal
    nearest = math.inf
    for i in range(size):
        nearest = min(nearest, gx * window.x[i] + gy * window.y[i] - window.inset[i])
    count, widest = 0, 0.0
    for i in range(size):
        if gx * window.x[i] + gy * window.y[i] - window.inset[i] <= nearest + window.std[i]:
            count, widest = count + 1, max(widest, window.std[i])
    return nearest, nearest - parameters.range_sigmas[min(count, len(parameters.range_sigmas)) - 1] * widest


@kernel
def _left(seen, count, normal, nearest, offset, parameters):
    """Leave the points in `seen` that a half-space does not keep off; return how many there are."""
    gx, gy = normal
    left = 0
    for i in range(count):
        ahead = gx * seen.x[i] + gy * seen.y[i] - seen.inset[i]
        if ahead < min(nearest, offset + parameters.sigmas * seen.std[i]):
            _copy(seen, i, seen, left)
            left += 1
    return left
