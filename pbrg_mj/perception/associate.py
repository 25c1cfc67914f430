"""Which sighting is which track."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.angles import wrapped

GATE = 13.8  # chi-squared with 2 degrees: 1 true sighting in 1000 is beyond
NEAR_ANGLE, NEAR_OFFSET = (
    math.radians(10.0),
    0.15,
)  # a sighting this near a wall, but outside its gate, is strange
FREE_GAP, HIDDEN_GAP = 0.15, 0.6  # [m] between two stretches of one wall, with a true end between or not
SAME_ANGLE, SAME_OFFSET = math.radians(1.0), 0.01  # tracks this close are one wall, however sure they are
NEW, UPDATE, EXTEND, STRANGE = 0, 1, 2, 3


@kernel
def associate(tracks, view):
    """Return a role (L,) for every line of a scan, and the track (L,) it belongs to (-1 for NEW).

    Nearest pairs first (Mahalanobis), one line a track: it UPDATEs it. A further line of the same track EXTENDs it.
    STRANGE is a line too near a track to be another wall and too far to be this one.
    """
    lines = len(view.angle)
    role, which = np.zeros(lines, np.int64), np.full(lines, -1)
    cost = np.full((lines, len(tracks)), math.inf)
    for line in range(lines):
        for i in range(len(tracks)):
            if tracks[i]["live"] and _overlaps(tracks[i], view, line):
                cost[line, i] = distance(tracks[i], view, line)
                if cost[line, i] > GATE and role[line] == NEW and _is_near(tracks[i], view, line):
                    role[line], which[line] = STRANGE, i
    taken = np.zeros(len(tracks), np.bool_)
    for _ in range(lines):
        line, i = divmod(int(np.argmin(cost)), len(tracks))
        if cost[line, i] > GATE:
            break
        role[line], which[line] = EXTEND if taken[i] else UPDATE, i
        taken[i] = True
        cost[line] = math.inf
    return role, which


@kernel
def distance(track, view, line):
    """Return the squared Mahalanobis distance of a line from a track."""
    a = wrapped(view.angle[line] - track["angle"])
    if abs(a) > 0.5:
        return math.inf
    c = view.offset[line] - track["offset"]
    r = view.covariance[line]
    saa, sac, scc = track["p_aa"] + r[0, 0], track["p_ac"] + r[0, 1], track["p_cc"] + r[1, 1]
    return (scc * a * a - 2 * sac * a * c + saa * c * c) / (saa * scc - sac * sac)


@kernel
def _is_near(track, view, line):
    turn = wrapped(view.angle[line] - track["angle"])
    middle = 0.5 * (view.low[line] + view.high[line])
    return abs(turn) < NEAR_ANGLE and abs(view.offset[line] - track["offset"] + turn * middle) < NEAR_OFFSET


@kernel
def _overlaps(track, view, line):
    """Return whether the stretches of track and line touch, but for a gap that may be hidden."""
    if view.low[line] > track["high"]:
        ended = track["high_bound"] < math.inf or view.free_low[line]
        return view.low[line] - track["high"] < (FREE_GAP if ended else HIDDEN_GAP)
    ended = track["low_bound"] > -math.inf or view.free_high[line]
    return track["low"] - view.high[line] < (FREE_GAP if ended else HIDDEN_GAP)


@kernel
def same_wall(a, b):
    """Return whether two tracks are one wall: the same line within their errors, and no true end between them."""
    turn = wrapped(b["angle"] - a["angle"])
    if abs(turn) > 0.2:
        return False
    saa, sac = a["p_aa"] + b["p_aa"] + SAME_ANGLE**2, a["p_ac"] + b["p_ac"]
    scc = a["p_cc"] + b["p_cc"] + SAME_OFFSET**2
    c = b["offset"] - a["offset"]
    if scc * turn * turn - 2 * sac * turn * c + saa * c * c > GATE * (saa * scc - sac * sac):
        return False
    if b["low"] > a["high"]:
        return a["high_bound"] == math.inf and b["low_bound"] == -math.inf
    if a["low"] > b["high"]:
        return a["low_bound"] == -math.inf and b["high_bound"] == math.inf
    return True
