"""The rows of velocities that keep a robot its distance from others and from half-spaces, for `separation`.

Each is normal.w <= offset. Where what comes nearer pushes the robot back, or it is beyond a half-space or too near to a
robot, w must also retreat along -normal. `numbers` are distance and margin [m], gain and rate [1/s], tick [s], the
robot's speed, and min_speed, the least at which it goes back from beyond a half-space [m/s]; `half_spaces`, the
`HalfSpaces.arrays`, and q, displacement, u (n, 2) are those of `write_driven`; j is the robot whose rows they are.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

UNCERTAIN = 0.005  # [m] beyond a half-space at rest, or too near to a robot, for which noise suffices: who is so stays
MOST_BEYOND = 0.05  # [m] of these that count: half-spaces of what is seen anew may be farther behind a robot


@kernel
def _violation(beyond):
    """Return how much of a violation [m] counts: what exceeds noise, up to the most."""
    return min(max(beyond - UNCERTAIN, 0.0), MOST_BEYOND)


@kernel
def _is_approached(half_spaces, j):
    """Tell whether some half-space that binds robot j comes nearer."""
    _, h, active, binds, closing, _ = half_spaces
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if active[i, k] and binds[i, k, j] and closing[i, k] > 0.0:
                return True
    return False


@kernel
def is_pushed_back(half_spaces, q, j, margin, gain):
    """Tell whether some half-space that comes nearer pushes robot j back, perhaps faster than it wants to go."""
    G, h, active, binds, closing, _ = half_spaces
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if active[i, k] and binds[i, k, j] and closing[i, k] > 0.0:
                behind = h[i, k] - margin - (G[i, k, 0] * q[j, 0] + G[i, k, 1] * q[j, 1])
                if gain * behind < closing[i, k]:
                    return True
    return False


@kernel
def is_beyond_half_space(half_spaces, q, j, margin):
    """Tell whether robot j is beyond some half-space that binds it by more than its noise."""
    G, h, active, binds, _, _ = half_spaces
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            behind = h[i, k] - margin - (G[i, k, 0] * q[j, 0] + G[i, k, 1] * q[j, 1])
            if active[i, k] and binds[i, k, j] and _violation(-behind) > 0.0:
                return True
    return False


@kernel
def is_in_its_way(half_spaces, q, robot, which, numbers):
    """Tell whether a robot is between the ends of the face of half-space `which` (i, k), and not on its other side.

    `numbers` (2,) are distance and margin [m] of SeparationFilter.
    """
    (G, h, _, _, _, spans), (i, k), (distance, margin) = half_spaces, which, numbers
    along = G[i, k, 0] * q[robot, 1] - G[i, k, 1] * q[robot, 0]
    behind = h[i, k] - margin - (G[i, k, 0] * q[robot, 0] + G[i, k, 1] * q[robot, 1])
    return spans[i, k, 0] < along < spans[i, k, 1] and behind > -distance


@kernel
def approach_of_team_mates(half_spaces, q, j, numbers):
    """Return what each other robot (n,) needs of robot j, gain times a distance, and how fast it comes to j [m/s].

    It is pushed back by what binds j and comes, for which both are small, unless it is beside that.
    """
    G, h, active, binds, closing, _ = half_spaces
    distance, margin, gain = numbers
    approach = np.zeros(len(q))
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if not (active[i, k] and binds[i, k, j] and closing[i, k] > 0.0):
                continue
            Gx, Gy = G[i, k, 0], G[i, k, 1]
            for other in range(len(q)):
                x, y = q[j, 0] - q[other, 0], q[j, 1] - q[other, 1]
                apart, along = math.sqrt(x * x + y * y), -(Gx * x + Gy * y)
                if along > 0.0 and is_in_its_way(half_spaces, q, other, (i, k), (distance, margin)):
                    behind = h[i, k] - margin - (Gx * q[other, 0] + Gy * q[other, 1])
                    speed = closing[i, k]
                    retreat = min(max(speed - gain * behind, 0.0), speed)
                    room = min(max(2.0 * speed - gain * behind, 0.0), speed)
                    approach[other] = max(approach[other], (retreat + room) * along / apart)
    return approach


@kernel
def makes_room(q, j, approach, numbers):
    """Tell whether robot j must move away from some other robot that is pushed back towards it.

    `approach` (n,) [m/s] as `approach_of_team_mates` returns it.
    """
    distance, gain = numbers
    for i in range(len(q)):
        apart = math.sqrt((q[i, 0] - q[j, 0]) ** 2 + (q[i, 1] - q[j, 1]) ** 2)
        if approach[i] > 0.0 and gain * (apart - distance) < approach[i]:
            return True
    return False


@kernel
def write_room_for_team_mates(q, j, approach, numbers, written, rows):
    """Append the rows of robots that are pushed back towards robot j, and how fast it makes room for them.

    `approach` (n,) [m/s] as `approach_of_team_mates` returns it; `written` as for `write_half_space_rows`.
    """
    distance, gain, speed = numbers
    normals, offsets, retreats, comes = written
    for i in range(len(q)):
        x, y = q[i, 0] - q[j, 0], q[i, 1] - q[j, 1]
        apart = math.sqrt(x * x + y * y)
        required = gain * (apart - distance) - approach[i]
        bound, retreat = max(0.0, required), max(0.0, -required)
        if approach[i] > 0.0 and (bound < speed or retreat > 0.0):
            normals[rows, 0], normals[rows, 1], offsets[rows], retreats[rows] = x / apart, y / apart, bound, retreat
            comes[rows] = False
            rows += 1
    return rows


@kernel
def violates_separation(q, j, distance):
    """Tell whether some other robot is nearer to robot j than the distance [m] by more than noise."""
    for i in range(len(q)):
        apart = math.sqrt((q[i, 0] - q[j, 0]) ** 2 + (q[i, 1] - q[j, 1]) ** 2)
        if i != j and _violation(distance - apart) > 0.0:
            return True
    return False


@kernel
def write_separation_rows(q, j, numbers, written):
    """Write the rows of robots so near that a velocity of this speed may violate them; return how many.

    From those nearer than the distance robot j retreats. `written` as for `write_half_space_rows`.
    """
    distance, rate, speed = numbers
    normals, offsets, retreats, _ = written
    rows = 0
    for i in range(len(q)):
        x, y = q[i, 0] - q[j, 0], q[i, 1] - q[j, 1]
        apart = math.sqrt(x * x + y * y)
        bound, retreat = rate * max(apart - distance, 0.0), rate * _violation(distance - apart)
        if i != j and (bound < speed or retreat > 0.0) and apart > 0.0:
            normals[rows, 0], normals[rows, 1], offsets[rows], retreats[rows] = x / apart, y / apart, bound, retreat
            rows += 1
    return rows


@kernel
def write_half_space_rows(half_spaces, state, j, numbers, written, rows):
    """Append the rows of half-spaces that bind robot j likewise, and how fast they push it back.

    Those that come nearer do so, and those at rest where the robot is beyond them.

    `state` is q, displacement and u, each (n, 2), and `forbidden`, whether rows forbid m; `written` are normals (R, 2),
    offsets (R,), retreats (R,) [m/s] and comes (R,), whether they are of what comes nearer; `rows` of each are there.
    """
    G, h, active, binds, closing, _ = half_spaces
    normals, offsets, retreats, comes = written
    q, displacement, u, forbidden = state
    margin, gain, tick, speed, min_speed = numbers
    wanted_x, wanted_y = u[j, 0] - gain * displacement[j, 0], u[j, 1] - gain * displacement[j, 1]
    in_haste = _is_approached(half_spaces, j)  # turns beside what stands may not wait
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            if not (active[i, k] and binds[i, k, j]):
                continue
            Gx, Gy = G[i, k, 0], G[i, k, 1]
            behind = h[i, k] - margin - (Gx * q[j, 0] + Gy * q[j, 1])
            ahead = Gx * (tick * u[j, 0] - displacement[j, 0]) + Gy * (tick * u[j, 1] - displacement[j, 1])
            fastest = ahead / tick if in_haste else min(ahead / tick, Gx * wanted_x + Gy * wanted_y)
            bound = max(0.0, gain * behind, fastest if ahead <= behind and not forbidden else 0.0)
            retreat = gain * _violation(-behind)
            if retreat > 0.0:
                retreat = max(retreat, min_speed)
            if closing[i, k] > 0.0:
                required = gain * behind - closing[i, k]
                bound, retreat = max(0.0, required), max(0.0, -required)
            if bound < speed or retreat > 0.0:
                normals[rows, 0], normals[rows, 1], offsets[rows], retreats[rows] = Gx, Gy, bound, retreat
                comes[rows] = closing[i, k] > 0.0
                rows += 1
    return rows
