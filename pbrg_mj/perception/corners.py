"""Which tracks are faces of one convex obstacle, and the corners of its outline."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.angles import wrapped
from pbrg_mj.perception.confirm import rests_across

FAR = 100.0  # [m] a wall whose end has not been seen goes on so far
LEAST_TURN, MOST_TURN = math.radians(20.0), math.radians(160.0)  # between two faces at a corner
REACH = 0.2  # [m] a corner may lie so far inside the stretch seen, and twice that beyond
BEYOND = 0.02  # [m] a face lies so far behind the other's line, at a convex corner


@kernel
def ends(track):
    """Return where a face begins and ends along t: beyond the stretch seen, as far as no beam has passed it by."""
    low = min(track["low_bound"], track["low"]) if track["low_bound"] > -math.inf else track["low"] - FAR
    return low, max(track["high_bound"], track["high"]) if track["high_bound"] < math.inf else track["high"] + FAR


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
def convex_corner(a, b):
    """Return whether the high end of a and the low end of b are a convex corner, seen from outside.

    At a convex corner each face goes away behind the other's line; in a corner of a room it comes towards the robot.
    """
    turn = wrapped(b["angle"] - a["angle"])
    if not LEAST_TURN < -turn < MOST_TURN:
        return False  # counter-clockwise round the robot, a convex obstacle's faces turn clockwise
    s_a, s_b = crossing(a, b)
    return (
        -REACH < s_a - a["high"] < 2 * REACH
        and -REACH < b["low"] - s_b < 2 * REACH
        and a["low"] < s_a - BEYOND
        and b["high"] > s_b + BEYOND
    )


@kernel
def chains(tracks):
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
            if i != j and b["live"] and b["confirmed"] and before[j] < 0 and convex_corner(a, b):
                gap = abs(crossing(a, b)[0] - a["high"])
                if gap < nearest:
                    nearest = gap
                    following[i] = j
        if following[i] >= 0:
            before[following[i]] = i
    return before, following


@kernel
def confirm_corners(tracks):
    """Confirm two faces that meet when neither moves along its normal: together they cannot move at all."""
    for i in range(len(tracks)):
        a = tracks[i]
        for j in range(len(tracks) if a["live"] else 0):
            b = tracks[j]
            if b["live"] and _rests(a) and _rests(b) and convex_corner(a, b):
                a["confirmed"] = b["confirmed"] = 1


@kernel
def _rests(track):
    return track["confirmed"] or rests_across(track)
