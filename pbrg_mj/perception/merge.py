"""Tracks that turn out to be one wall made one."""

from __future__ import annotations

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.associate import GATE, distance, same_wall

COVERED = 0.1  # [m] of a track must lie on the line that shows it to be part of a longer wall


@kernel
def merge(tracks):
    """Make tracks that have come to be the same wall one."""
    for i in range(len(tracks)):
        for j in range(i if tracks[i]["live"] else 0):
            if tracks[i]["live"] and tracks[j]["live"] and same_wall(tracks[i], tracks[j]):
                _absorb(tracks, i, j)


@kernel
def unite(tracks, line, track):
    """Make all tracks one that a single line runs through, whatever ends they have seemed to have; return which."""
    for i in range(len(tracks)):
        if i != track and tracks[i]["live"] and _runs_through(tracks[i], line):
            track = _absorb(tracks, track, i)
    return track


@kernel
def _runs_through(track, line):
    common = min(track["high"], line["high"]) - max(track["low"], line["low"])
    return common > COVERED and distance(track, line) <= GATE


@kernel
def _absorb(tracks, i, j):
    """Make two tracks one; return the one that stays, the confirmed and older one."""
    a, b = tracks[i], tracks[j]
    if (b["confirmed"], -b["first"]) > (a["confirmed"], -a["first"]):
        i, a, b = j, b, a
    if b["low"] < a["low"]:
        a["low"], a["low_bound"] = b["low"], b["low_bound"]
    if b["high"] > a["high"]:
        a["high"], a["high_bound"] = b["high"], b["high_bound"]
    if b["seen"] >= a["seen"]:
        a["seen"], a["unseen"] = b["seen"], b["unseen"]
    b["live"] = 0
    return i
