"""Which line of a scan belongs to which track, and which tracks are one line."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped

GATE = 13.8  # chi-squared with 2 degrees: 1 true sighting in 1000 is beyond
NEW, UPDATE, EXTEND, CONFLICT = 0, 1, 2, 3


@kernel
def associate(tracks, lines, params):
    """Write the role of every line (L,) of a scan, and the track it belongs to (-1 for NEW).

    Nearest pairs first (Mahalanobis), one line a track: it UPDATEs it. A further line of the same track EXTENDs it.
    CONFLICT is a line too near a track to be another line and too far to be this one.
    """
    cost = np.full((len(lines), len(tracks)), math.inf)
    for k in range(len(lines)):
        line = lines[k]
        for i in range(len(tracks)):
            if tracks[i]["live"] and _overlaps(tracks[i], line, params):
                cost[k, i] = distance(tracks[i], line)
                if cost[k, i] > GATE and line["role"] == NEW and _is_near(tracks[i], line, params):
                    line["role"], line["track"] = CONFLICT, i
    for _ in range(len(lines)):
        k, i = _cheapest(cost)
        if k < 0:
            break
        lines[k]["role"], lines[k]["track"] = EXTEND if _is_taken(lines, i) else UPDATE, i
        for other in range(len(tracks)):
            cost[k, other] = math.inf


@kernel
def _cheapest(cost):
    """Return the line and the track of the least cost (L, M) within the gate, the first of equals, or -1, -1."""
    line, track, least = -1, -1, math.inf
    for k in range(cost.shape[0]):
        for i in range(cost.shape[1]):
            if cost[k, i] <= GATE and cost[k, i] < least:
                line, track, least = k, i, cost[k, i]
    return line, track


@kernel
def _is_taken(lines, track):
    taken = False
    for k in range(len(lines)):
        taken = taken or (lines[k]["role"] == UPDATE and lines[k]["track"] == track)
    return taken


@kernel
def distance(track, line):
    """Return the squared Mahalanobis distance of a line from a track."""
    a = wrapped(line["angle"] - track["angle"])
    if abs(a) > 0.5:
        return math.inf
    c = line["offset"] - track["offset"]
    saa, sac, scc = track["p_aa"] + line["c_aa"], track["p_ac"] + line["c_ac"], track["p_cc"] + line["c_cc"]
    return (scc * a * a - 2 * sac * a * c + saa * c * c) / (saa * scc - sac * sac)


@kernel
def _is_near(track, line, params):
    turn = wrapped(line["angle"] - track["angle"])
    middle = 0.5 * (line["low"] + line["high"])
    return abs(turn) < params.near_angle and abs(line["offset"] - track["offset"] + turn * middle) < params.near_offset


@kernel
def _overlaps(track, line, params):
    """Return whether the extents of track and line touch, but for a gap that may be hidden."""
    if line["low"] > track["high"]:
        ended = track["high_bound"] < math.inf or line["free_low"]
        return line["low"] - track["high"] < (params.free_gap if ended else params.hidden_gap)
    ended = track["low_bound"] > -math.inf or line["free_high"]
    return track["low"] - line["high"] < (params.free_gap if ended else params.hidden_gap)


@kernel
def same_line(a, b, params):
    """Return whether two tracks are one line: the same within their errors, and no true end between them."""
    turn = wrapped(b["angle"] - a["angle"])
    if abs(turn) > 0.2:
        return False
    saa, sac = a["p_aa"] + b["p_aa"] + params.same_angle**2, a["p_ac"] + b["p_ac"]
    scc = a["p_cc"] + b["p_cc"] + params.same_offset**2
    c = b["offset"] - a["offset"]
    if scc * turn * turn - 2 * sac * turn * c + saa * c * c > GATE * (saa * scc - sac * sac):
        return False
    if b["low"] > a["high"]:
        return a["high_bound"] == math.inf and b["low_bound"] == -math.inf
    if a["low"] > b["high"]:
        return a["low_bound"] == -math.inf and b["high_bound"] == math.inf
    return True


@kernel
def merge(tracks, params):
    """Merge tracks that have come to be the same line."""
    for i in range(len(tracks)):
        for j in range(i if tracks[i]["live"] else 0):
            if tracks[i]["live"] and tracks[j]["live"] and same_line(tracks[i], tracks[j], params):
                _absorb(tracks, i, j)


@kernel
def merge_tracks_on_line(tracks, line, track, params):
    """Merge all tracks that a single line runs through, whatever ends they have seemed to have; return which."""
    for i in range(len(tracks)):
        if i != track and tracks[i]["live"] and _runs_through(tracks[i], line, params):
            track = _absorb(tracks, track, i)
    return track


@kernel
def _runs_through(track, line, params):
    common = min(track["high"], line["high"]) - max(track["low"], line["low"])
    return common > params.least_overlap and distance(track, line) <= GATE


@kernel
def _absorb(tracks, i, j):
    """Merge two tracks; return the one that stays, the confirmed and older one."""
    a, b = tracks[i], tracks[j]
    if (b["confirmed"], -b["first"]) > (a["confirmed"], -a["first"]):
        i, a, b = j, b, a
    if b["low"] < a["low"]:
        a["low"], a["low_bound"] = b["low"], b["low_bound"]
    if b["high"] > a["high"]:
        a["high"], a["high_bound"] = b["high"], b["high_bound"]
    if b["seen"] >= a["seen"]:
        a["seen"], a["unseen"], a["away"] = b["seen"], b["unseen"], b["away"]
    b["live"] = 0
    return i
