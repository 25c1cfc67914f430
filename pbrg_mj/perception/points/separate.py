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

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.hull import gap_to_hull

REACH = 3.0  # [m] farther away from the way nothing is kept off
WINDOWS = (1.0, 0.5, 0.25, 0.1)  # [m] around the nearest point
ROOM = 0.8  # of the distance to the nearest point that its hull must leave to the way
SAME_FACE = math.cos(math.radians(20.0))  # between the normals of one face in two scans
STEADY = 0.01  # [m] of room that may be lost so that a normal does not turn with the noise of every scan


@kernel
def separate(points, q, target, parameters, G, h, active):
    """Write half-spaces G (K, 2), h (K,), active (K,) for the hand point q (2,) [m] on its way to `target` (2,) [m].

    On entry they are those of the scan before, whose slots and, where they serve as well, normals are taken over.
    """
    way = _free_way(points, q, target, parameters)
    waiting, window = np.empty(len(points), np.bool_), np.empty(len(points), np.bool_)
    for i in range(len(points)):
        waiting[i] = points[i]["live"] == 1 and points[i]["binds"] == 1
    old, was_active, taken = G.copy(), active.copy(), np.zeros(len(h), np.bool_)
    for _ in range(len(h)):
        found, nx, ny = _next_face(points, waiting, window, way)
        if not found:
            break
        k = _slot(points, window, way, (nx, ny), (old, was_active, taken))
        if was_active[k] and nx * old[k, 0] + ny * old[k, 1] > SAME_FACE:
            nx, ny = old[k, 0], old[k, 1]
        taken[k] = True
        G[k, 0], G[k, 1] = nx, ny
        h[k] = _offset(points, waiting, window, (nx, ny), parameters)
    for k in range(len(h)):
        active[k] = taken[k]
        if not taken[k]:
            G[k, 0], G[k, 1], h[k] = 0.0, 0.0, 0.0


@kernel
def _next_face(points, waiting, window, way):
    """Mark in `window` the points of the face nearest to the way; return whether there is one, and its normal."""
    nearest, best, gx, gy = -1, REACH, 0.0, 0.0
    for i in range(len(points)):
        if waiting[i]:
            distance, x, y = _from_way(points[i], way)
            if 0.0 < distance < best:
                nearest, best, gx, gy = i, distance, x / distance, y / distance
    if nearest < 0:
        return False, 0.0, 0.0
    centre = points[nearest]
    for radius in WINDOWS:
        for i in range(len(points)):
            x, y = points[i]["x"] - centre["x"], points[i]["y"] - centre["y"]
            window[i] = waiting[i] and x * x + y * y <= radius * radius
        gap, x, y = gap_to_hull(points, window, way)
        if gap >= ROOM * best:
            return True, x / gap, y / gap
    for i in range(len(points)):
        window[i] = i == nearest
    return True, gx, gy


@kernel
def _slot(points, window, way, normal, before):
    """Return the slot of the same face in the scan before, if its normal serves as well; else a free one."""
    old, was_active, taken = before
    nx, ny = normal
    room, best, free = _room(points, window, way, nx, ny), -1, -1
    for k in range(len(taken)):
        if taken[k]:
            continue
        if was_active[k] and nx * old[k, 0] + ny * old[k, 1] > SAME_FACE:
            if best < 0 and _room(points, window, way, old[k, 0], old[k, 1]) >= room - STEADY:
                best = k
        elif free < 0 or (was_active[free] and not was_active[k]):
            free = k
    if best >= 0:
        return best
    for k in range(len(taken)):  # no other is free: give the face up that was there
        if free < 0 and not taken[k]:
            free = k
            was_active[k] = False
    return free


@kernel
def _room(points, window, way, gx, gy):
    """Return how far the points of a window are ahead of the way along a unit vector [m]."""
    ahead = math.inf
    for i in range(len(points)):
        if window[i]:
            ahead = min(ahead, gx * points[i]["x"] + gy * points[i]["y"])
    return ahead - max(gx * way[0] + gy * way[1], gx * way[2] + gy * way[3])


@kernel
def _offset(points, waiting, window, normal, parameters):
    """Return h [m] of the half-space that keeps off a window's points, and take out all points that it keeps off."""
    gx, gy = normal
    nearest = math.inf
    for i in range(len(points)):
        if window[i]:
            ahead = gx * points[i]["x"] + gy * points[i]["y"] - _pose_inset(points[i], parameters)
            nearest = min(nearest, ahead)
    offset = nearest - _range_inset(points, window, gx, gy, nearest, parameters)
    for i in range(len(points)):
        if waiting[i]:
            ahead = gx * points[i]["x"] + gy * points[i]["y"] - _pose_inset(points[i], parameters)
            waiting[i] = ahead < min(nearest, offset + parameters.sigmas * points[i]["std"])
    return offset


@kernel
def _free_way(points, q, target, parameters):
    """Return both ends of the way: it ends where it first comes as near to a point as is allowed, or at the target."""
    dx, dy = target[0] - q[0], target[1] - q[1]
    length = math.sqrt(dx * dx + dy * dy)
    if not length > 0.0:
        return q[0], q[1], q[0], q[1]
    dx, dy, free = dx / length, dy / length, length
    for i in range(len(points)):
        point = points[i]
        if point["live"] == 0 or point["binds"] == 0:
            continue
        x, y, inset = point["x"] - q[0], point["y"] - q[1], _inset(point, parameters)
        along, squared = x * dx + y * dy, x * x + y * y
        across = squared - along * along
        if squared <= inset * inset:  # already nearer: any approach ends at once
            if along > 0.0:
                free = 0.0
        elif along > 0.0 and across < inset * inset:
            free = min(free, along - math.sqrt(inset * inset - across))
    return q[0], q[1], q[0] + free * dx, q[1] + free * dy


@kernel
def _inset(point, parameters):
    """Return how far the hand point must stay from a point, were it the only one [m]."""
    return _pose_inset(point, parameters) + parameters.sigmas * point["std"]


@kernel
def _pose_inset(point, parameters):
    return parameters.clearance + parameters.sigmas * point["pose_std"]


@kernel
def _range_inset(points, window, gx, gy, nearest, parameters):
    """Return how far behind a face the nearest of its echoes may lie [m], by how many lie as near within a sigma."""
    count, widest = 0, 0.0
    for i in range(len(points)):
        if window[i]:
            ahead = gx * points[i]["x"] + gy * points[i]["y"] - _pose_inset(points[i], parameters) - nearest
            if 0.0 <= ahead <= points[i]["std"]:
                count, widest = count + 1, max(widest, points[i]["std"])
    return parameters.range_sigmas[min(max(count, 1), len(parameters.range_sigmas)) - 1] * widest


@kernel
def _from_way(point, way):
    """Return the distance [m] from the way to a point or the surface between it and its neighbour, and the vector."""
    ax, ay, bx, by = way
    best, vx, vy = math.inf, 0.0, 0.0
    for corner in range(4):
        if corner < 2:  # an end of the surface, from the way
            ox, oy = (point["x"], point["y"]) if corner == 0 else (point["next_x"], point["next_y"])
            px, py = _nearest_on(ax, ay, bx, by, ox, oy)
        else:  # an end of the way, to the surface
            px, py = (ax, ay) if corner == 2 else (bx, by)
            ox, oy = _nearest_on(point["x"], point["y"], point["next_x"], point["next_y"], px, py)
        distance = math.sqrt((ox - px) ** 2 + (oy - py) ** 2)
        if distance < best:
            best, vx, vy = distance, ox - px, oy - py
    return best, vx, vy


@kernel
def _nearest_on(ax, ay, bx, by, x, y):
    """Return the point of the segment from a to b that is nearest to (x, y)."""
    dx, dy = bx - ax, by - ay
    squared = dx * dx + dy * dy
    share = 0.0 if squared == 0.0 else min(max(((x - ax) * dx + (y - ay) * dy) / squared, 0.0), 1.0)
    return ax + share * dx, ay + share * dy
