"""Out of the way of what comes nearer, before it presses a robot against something.

A half-space that falls at c pushes a robot back along -G, until another half-space or a robot stops it there. The face
behind the half-space has ends, beside which nothing comes. With e = h - G.q, r the room along -G, and c' the rate at
which that room falls, the robot is pressed after t = (max(0, e) + r) / (c + c'). It is beside the face after s / v: s
to the nearer end, of those that there is room to, and v what its wheels can do in that direction besides c. Between two
faces that both come it is not pressed once it is beside either of them: the end that it reaches first counts. Where t
is shorter than s / v and the `AHEAD` that turning and doubts of the speed take, that is where it wants to go, in place
of where eq. 2 has it go, and it has the right of way. The rows that it meets (separation_rows.py) stay as they are.

A robot that does not go out of the way itself makes room for one that does, before this comes: the room beside the face
is no way out while somebody stands in it. Whether robot i is pressed, and where the end of the face on its own side is,
it tells by the half-spaces that it knows itself; then i may come along the face as fast as at `FASTEST`.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.governor.velocity_filter.nearest_velocity import scale_for_wheels
from pbrg_mj.governor.velocity_filter.separation_rows import is_in_its_way
from pbrg_mj.kernel import kernel

NOTHING = (-1, -1)  # no half-space (owner, slot)
AHEAD = 1.4  # [s] a quarter turn, 0.4, and what a speed takes to be known, 1
OPPOSED = 0.3  # cosine of the angle between a direction and a normal: beyond it a robot slides along
FASTEST = 1.0  # [m/s] of wheels that have no limit, or that are not known


@kernel
def evasive_velocity(half_spaces, q, j, numbers, wheels, wanted):
    """Return (evades, x, y): whether robot j goes out of the way of what presses it first, and what it wants [m/s].

    That is the way out, or else `wanted` (2,).

    `half_spaces` (six arrays, n first) are `HalfSpaces.arrays`; `numbers` (2,) distance and margin [m] of
    SeparationFilter; `wheels` the robot's heading [rad] and facets (F, 2) [s/m].
    """
    h, active, binds, closing = half_spaces[1], half_spaces[2], half_spaces[3], half_spaces[4]
    soonest, evades, x, y = math.inf, False, wanted[0], wanted[1]
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if active[i, k] and binds[i, k, j] and closing[i, k] > 0.0:
                pressed, against = _pressed_after(half_spaces, q, (j, j), (i, k), numbers)
                if pressed < soonest:
                    time, aside_x, aside_y = _beside_after(half_spaces, q, j, (i, k), numbers, wheels)
                    if against != NOTHING and closing[against] > 0.0:
                        other = _beside_after(half_spaces, q, j, against, numbers, wheels)
                        if other[0] < time:
                            time, aside_x, aside_y = other
                    if pressed < time + AHEAD < math.inf:
                        soonest, evades, x, y = pressed, True, aside_x, aside_y
    return evades, x, y


@kernel
def evasive_closing_speeds(half_spaces, q, j, numbers):
    """Return how fast each other robot (n,) may come to j as it goes out of the way [m/s], by what j knows.

    `half_spaces` and `numbers` (2,) are those of `evasive_velocity`.
    """
    _, h, active, binds, closing, _ = half_spaces
    approach = np.zeros(len(q))
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if active[i, k] and binds[i, k, j] and closing[i, k] > 0.0:
                for other in range(len(q)):
                    far, towards = _way_past(half_spaces, q, (other, j), (i, k), numbers)
                    if far < math.inf:
                        pressed, _ = _pressed_after(half_spaces, q, (other, j), (i, k), numbers)
                        if pressed < far / FASTEST + AHEAD:
                            approach[other] = max(approach[other], FASTEST * towards)
    return approach


@kernel
def _way_past(half_spaces, q, who, which, numbers):
    """Return how far it is for a robot to the end of a face on another robot's side [m], and how much that leads to it.

    `who` are the numbers of both robots, `which` (i, k) the half-space. Infinite and 0 for who is not in the face's
    way, and for a robot and itself; the second is the cosine between the way and the direction to the other robot.
    """
    (G, _, _, _, _, spans), (one, other), (i, k) = half_spaces, who, which
    Gx, Gy = G[i, k, 0], G[i, k, 1]
    x, y = q[other, 0] - q[one, 0], q[other, 1] - q[one, 1]
    apart = math.sqrt(x * x + y * y)
    if apart == 0.0 or not is_in_its_way(half_spaces, q, one, which, numbers):
        return math.inf, 0.0
    along, aside = Gx * q[one, 1] - Gy * q[one, 0], (Gx * y - Gy * x) / apart
    return spans[i, k, 1] - along if aside > 0.0 else along - spans[i, k, 0], abs(aside)


@kernel
def _pressed_after(half_spaces, q, who, which, numbers):
    """Return when half-space `which` (i, k) presses a robot against something, if it stays on its way [s], and what.

    `who` are the numbers of that robot and of the one whose half-spaces count. What it is pressed against is another
    half-space (i, k), or NOTHING for another robot. `numbers` (2,) are those of `evasive_velocity`.
    """
    (G, h, _, _, closing, _), (i, k), (robot, _) = half_spaces, which, who
    behind = h[i, k] - numbers[1] - (G[i, k, 0] * q[robot, 0] + G[i, k, 1] * q[robot, 1])
    room, falls, against = _room(half_spaces, q, who, numbers, (-G[i, k, 0], -G[i, k, 1]))
    return (max(behind, 0.0) + room) / (closing[i, k] + falls), against


@kernel
def _beside_after(half_spaces, q, j, which, numbers, wheels):
    """Return when robot j may be beside the face of half-space `which` [s], and the velocity that takes it there (2,).

    The time is infinite where it is not in the face's way, or where there is room to no end that is known.
    """
    (G, _, _, _, closing, spans), (i, k), (heading, facets) = half_spaces, which, wheels
    tx, ty, c = -G[i, k, 1], G[i, k, 0], closing[i, k]
    along = tx * q[j, 0] + ty * q[j, 1]
    best, x, y = math.inf, 0.0, 0.0
    if spans[i, k, 0] < along < spans[i, k, 1]:
        for side in (-1.0, 1.0):
            far = spans[i, k, 1] - along if side > 0.0 else along - spans[i, k, 0]
            fastest = FASTEST * scale_for_wheels(FASTEST * side * tx, FASTEST * side * ty, heading, facets)
            if far < math.inf and fastest > c:
                speed = math.sqrt(fastest * fastest - c * c)
                room, falls, _ = _room(half_spaces, q, (j, j), numbers, (side * tx, side * ty))
                if far / speed < best and room - falls * far / speed >= far:
                    best, x, y = far / speed, side * speed * tx, side * speed * ty
    return best, x, y


@kernel
def _room(half_spaces, q, who, numbers, direction):
    """Return how far a robot can go in a direction (2,) [m], how fast that falls [m/s], and what stops it.

    `who` are its number and that of the robot whose half-spaces count. It is stopped by a half-space (i, k), or NOTHING
    for another robot and where nothing does, infinitely far away.
    """
    (G, h, active, binds, closing, _), (robot, knows) = half_spaces, who
    (distance, margin), (dx, dy) = numbers, direction
    room, falls, by = math.inf, 0.0, NOTHING
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            towards = G[i, k, 0] * dx + G[i, k, 1] * dy
            if active[i, k] and binds[i, k, knows] and towards > OPPOSED:
                behind = h[i, k] - margin - (G[i, k, 0] * q[robot, 0] + G[i, k, 1] * q[robot, 1])
                if max(behind, 0.0) / towards < room:
                    room, falls, by = max(behind, 0.0) / towards, closing[i, k] / towards, (i, k)
    for i in range(len(q)):
        x, y = q[i, 0] - q[robot, 0], q[i, 1] - q[robot, 1]
        ahead, across = x * dx + y * dy, x * dy - y * dx
        if i != robot and ahead > 0.0 and abs(across) < distance:
            free = max(ahead - math.sqrt(distance * distance - across * across), 0.0)
            if free < room:
                room, falls, by = free, 0.0, NOTHING
    return room, falls, by
