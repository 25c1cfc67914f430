"""How fast things come nearer: faces are tracked from scan to scan.

The track of a face takes in the flow beside the place where the face is nearest: it is, of those near that place, the
one that explains most of it. What begins to move, or changes its velocity, does not walk: where the flows of a scan
tell so together, the velocity is unknown again before they are fused.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face_track import mahalanobis_from_rest, reset_velocity
from pbrg_mj.perception.points.fuse_flows import fuse_faces, fuse_flows, has_maneuvered
from pbrg_mj.perception.points.gate import count_flows_in_gate

BESIDE = 0.4  # [m] from the nearest place of a face: flows that tell of its velocity
DEPTH = 0.06  # [m] behind it: flows of the same side of a thing
JUMP = 0.5  # [m] of a nearest place from scan to scan: along a face it is where noise and beams happen to put it
UNSEEN = 1.0  # [s] after which a track ends; one that moves does where no flow tells of it
MOVES = 13.8  # squared Mahalanobis distance of a velocity from rest: one face at rest in a thousand is beyond it
RESTS = 2.0  # and one at which what has moved rests again: half of all that rest are within 1.4


@kernel
def track_at(tracks, place, beside, along_faces, time):
    """Return the track of the face at a place (x, y, its range's standard deviation), with the flows beside it.

    `beside` are the flows of the scan, a `RangeFlow`, and those chosen of them, (size,); `along_faces` the same of its
    faces, for a track that moves. A track takes them in once.
    """
    track = _track_of(tracks, (place[0], place[1]), beside, time)
    if track["time"] < time or track["cxx"] == 0.0:
        _update(track, beside, along_faces, time)
        track["x"], track["y"], track["time"] = place[0], place[1], time
    return track


@kernel
def flows_beside(flows, chosen, place, normal):
    """Return which of the flows chosen are beside the place of a face (x, y, its std), and on its side."""
    (x, y, std), (nx, ny) = place, normal
    beside, size = np.empty(len(chosen), np.int64), 0
    for i in chosen:
        dx, dy = flows.x[i] - x, flows.y[i] - y
        if dx * dx + dy * dy <= BESIDE * BESIDE and nx * dx + ny * dy <= DEPTH + 2.0 * std:
            beside[size] = i
            size += 1
    return beside[:size]


@kernel
def _update(track, beside, along_faces, time):
    """Fuse the flows beside a face with the velocity of its track; tell whether it moves.

    `beside` and `along_faces` (flows, chosen) are of this scan. Where none tells of it, what moves goes on: that it is
    less well known by then does not bring it to rest.
    """
    moves = track["moves"]
    if moves and time - track["told"] > UNSEEN:
        moves = False
        reset_velocity(track)
    if moves:
        if 2 * count_flows_in_gate(track, along_faces, time) < len(along_faces[1]):
            track["cxx"] = 0.0
        fuse_faces(track, along_faces, time)
        track["moves"] = mahalanobis_from_rest(track) > RESTS or track["told"] < time
    else:
        if has_maneuvered(track, beside, time):
            reset_velocity(track)
        fuse_flows(track, beside, time)
        track["moves"] = mahalanobis_from_rest(track) > MOVES


@kernel
def _track_of(tracks, place, beside, time):
    """Return the track of a face: of those near its place the one that explains most of the flows beside it.

    `place` (x, y) [m]; `beside` (flows, chosen) as for `flows_outside_gate`. One that explains less than half of them
    is another face's. Where none is left, a new one is begun.
    """
    best, most, found, free = JUMP * JUMP, (len(beside[1]) + 1) // 2, -1, 0
    for i in range(len(tracks)):
        track = tracks[i]
        if track["live"] and time - track["time"] > UNSEEN:
            track["live"] = False
        if track["live"]:
            ahead = time - track["time"]
            dx, dy = track["x"] + ahead * track["vx"] - place[0], track["y"] + ahead * track["vy"] - place[1]
            squared = dx * dx + dy * dy
            if squared < JUMP * JUMP:
                count = count_flows_in_gate(track, beside, time)
                if count > most or (count == most and squared < best):
                    best, most, found = squared, count, i
        if not track["live"] or (tracks[free]["live"] and track["time"] < tracks[free]["time"]):
            free = i
    if found < 0:
        found = free
        new = tracks[found]
        new["x"], new["y"], new["time"], new["live"], new["moves"], new["told"] = (
            place[0],
            place[1],
            time,
            True,
            False,
            time,
        )
        reset_velocity(new)
    return tracks[found]
