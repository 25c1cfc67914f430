"""Which tracks are faces of one convex obstacle, and the corners of its outline."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped
from pbrg_mj.perception.track.confirmation import is_at_rest_across
from pbrg_mj.perception.track.extent import track_ends

FACE, OTHER, HIDDEN = range(3)  # columns of a corner's `sides`


@kernel
def point(track, s):
    """Return x, y of the place at coordinate s of a track, from the anchor."""
    cos, sin = math.cos(track["angle"]), math.sin(track["angle"])
    return track["offset"] * cos - s * sin, track["offset"] * sin + s * cos


@kernel
def crossing(a, b):
    """Return the coordinates along a and along b where the two lines meet."""
    turn = b["angle"] - a["angle"]
    sin, cos = math.sin(turn), math.cos(turn)
    return (b["offset"] - a["offset"] * cos) / sin, (b["offset"] * cos - a["offset"]) / sin


@kernel
def convex_corner(a, b, params):
    """Return whether the high end of a and the low end of b are a convex corner, seen from outside.

    At a convex corner each face goes away behind the other's line; in a corner of a room it comes towards the robot.
    """
    turn = wrapped(b["angle"] - a["angle"])
    if not params.least_turn < -turn < params.most_turn:
        return False  # counter-clockwise round the robot, a convex obstacle's faces turn clockwise
    s_a, s_b = crossing(a, b)
    return (
        -params.corner_reach < s_a - a["high"] < 2 * params.corner_reach
        and -params.corner_reach < b["low"] - s_b < 2 * params.corner_reach
        and a["low"] < s_a - params.corner_tolerance
        and b["high"] > s_b + params.corner_tolerance
    )


@kernel
def face_chains(tracks, params):
    """Return (M,) the faces before and (M,) after each face of a convex obstacle, counter-clockwise round the robot.

    -1 for none. The nearest corner wins where several are possible.
    """
    before, following = np.full(len(tracks), -1), np.full(len(tracks), -1)
    for i in range(len(tracks)):
        a = tracks[i]
        if not (a["live"] and a["confirmed"]):
            continue
        nearest = math.inf
        for j in range(len(tracks)):
            b = tracks[j]
            if i != j and b["live"] and b["confirmed"] and before[j] < 0 and convex_corner(a, b, params):
                gap = abs(crossing(a, b)[0] - a["high"])
                if gap < nearest:
                    nearest = gap
                    following[i] = j
        if following[i] >= 0:
            before[following[i]] = i
    return before, following


@kernel
def confirm_corners(tracks, params):
    """Confirm two faces that meet when neither moves along its normal: together they cannot move at all."""
    for i in range(len(tracks)):
        a = tracks[i]
        for j in range(len(tracks) if a["live"] else 0):
            b = tracks[j]
            if b["live"] and _rests(a, params) and _rests(b, params) and convex_corner(a, b, params):
                a["confirmed"] = b["confirmed"] = 1


@kernel
def _rests(track, params):
    return track["confirmed"] or is_at_rest_across(track, params)


@kernel
def outline(tracks, root, links, hand, params):
    """Return the corners of the obstacle whose first face is `root`; links are the faces before and after each (M,).

    They are (points (N, 2) from the anchor [m], s (N,) along the corner's face [m], sides (N, 3)). The sides are the
    FACE it lies on, the OTHER face that meets it there or -1, and HIDDEN: 1 if no beam has seen it but it follows from
    the faces. They are arrays, not records, because numba frees an array after the last use of its name, even if a
    record of it is read later.

    Faces end at the corner with the next, or where `track_ends` says. Two faces are closed to a parallelogram, one is
    `face_depth` deep, or less if the robot's hand point (2,) is behind it.
    """
    before, after = links
    most = 4 * _faces(root, after)
    corners = np.empty((most, 2)), np.empty(most), np.empty((most, 3), np.int64)
    size, face = 0, root
    start_x, start_y = 0.0, 0.0
    while face >= 0:
        track = tracks[face]
        low, high = track_ends(track)
        joined = before[face] >= 0
        if joined:
            low = crossing(tracks[before[face]], track)[1]
        if after[face] >= 0:
            high = crossing(track, tracks[after[face]])[0]
        x, y = point(track, low)
        if not joined:  # else it is there as the end of the face before
            size = _add(corners, size, (x, y), (low, face, -1, 0))
        far_x, far_y = point(track, high)
        size = _add(corners, size, (far_x, far_y), (high, face, after[face], 0))
        if joined and face != root:
            size = _add(corners, size, (start_x + far_x - x, start_y + far_y - y), (high, face, -1, 1))
        if not joined and after[face] < 0:
            depth = _depth(track, low, high, hand, params)
            nx, ny = depth * math.cos(track["angle"]), depth * math.sin(track["angle"])
            size = _add(corners, size, (x + nx, y + ny), (low, face, -1, 1))
            size = _add(corners, size, (far_x + nx, far_y + ny), (high, face, -1, 1))
        start_x, start_y = x, y
        face = after[face]
        if face == root:
            break
    points, along, sides = corners
    return points[:size], along[:size], sides[:size]


@kernel
def _faces(root, after):
    """Return how many faces an obstacle has from its first on."""
    count, face = 1, after[root]
    while face >= 0 and face != root:
        count, face = count + 1, after[face]
    return count


@kernel
def _add(corners, size, place, what):
    points, along, sides = corners
    points[size, 0], points[size, 1] = place
    along[size], sides[size, FACE], sides[size, OTHER], sides[size, HIDDEN] = what
    return size + 1


@kernel
def _depth(track, low, high, hand, params):
    """Return how deep a lone face is: where the robot's hand (2,) [m] has got to behind it, there is nothing."""
    cos, sin = math.cos(track["angle"]), math.sin(track["angle"])
    beyond = hand[0] * cos + hand[1] * sin - track["offset"]
    s = hand[1] * cos - hand[0] * sin
    if low <= s <= high and beyond > params.clearance:
        return min(params.face_depth, beyond - params.clearance)
    return params.face_depth
