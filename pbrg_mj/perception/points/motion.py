"""How fast things come nearer: faces are tracked from scan to scan, each with a velocity and its covariance.

A Kalman filter whose velocity walks at random fuses the track of a face with the range flow (range_flow.py) beside the
place where the face is nearest; once the track moves, with the flow of whole faces (face_flow.py). A face's track is,
of those near that place, the one that explains most of the flow. What begins to move, or changes its velocity, does not
walk: where the flows of a scan tell so together, the velocity is unknown again before they are fused.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.normal_flow import ANY_SPEED, FASTEST

TRACK = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy", "cxx", "cxy", "cyy", "time", "told")]
    + [(name, "?") for name in ("live", "moves")]
)
"""Nearest place of a face [m], its velocity [m/s] and covariance [m^2/s^2], when it was last updated and when a flow
last told of it [s]; whether it moves."""

TRACKS = 12  # a robot
BESIDE = 0.4  # [m] from the nearest place of a face: flows that tell of its velocity
DEPTH = 0.06  # [m] behind it: flows of the same side of a thing
JUMP = 0.5  # [m] of a nearest place from scan to scan: along a face it is where noise and beams happen to put it
UNSEEN = 1.0  # [s] after which a track ends; one that moves does where no flow tells of it
WALK = 0.1  # [m/s] by which the velocity of what moves walks in a second
WALK_AT_REST = 0.02  # [m/s] and of what seems to rest
MOVES = 13.8  # squared Mahalanobis distance of a velocity from rest: one face at rest in a thousand is beyond it
RESTS = 2.0  # and one at which what has moved rests again: half of all that rest are within 1.4
OTHER = 9.0  # squared innovation of a flow that is not this face's: where a line joins two faces
MANEUVER = 25.0  # squared Mahalanobis distance between a velocity and what the flows of a scan tell of it alone
LEAST_FLOWS = 6  # that may tell of a maneuver: a corner between beams makes a few


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
def speed_along(track, normal):
    """Return how fast a face comes along -normal [m/s]: 0 until it is known to move, then by a deviation more."""
    nx, ny = normal
    speed = -(nx * track["vx"] + ny * track["vy"])
    variance = nx * nx * track["cxx"] + 2.0 * nx * ny * track["cxy"] + ny * ny * track["cyy"]
    return min(max(speed + math.sqrt(variance), 0.0), FASTEST) if track["moves"] else 0.0


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
def any_moving(tracks):
    """Tell whether any track moves."""
    moving = False
    for i in range(len(tracks)):
        moving = moving or (tracks[i]["live"] and tracks[i]["moves"])
    return moving


@kernel
def any_moving_within(tracks, q, radius):
    """Tell whether any track that moves is within a radius [m] around a place q (2,) [m]."""
    near = False
    for i in range(len(tracks)):
        dx, dy = tracks[i]["x"] - q[0], tracks[i]["y"] - q[1]
        near = near or (tracks[i]["live"] and tracks[i]["moves"] and dx * dx + dy * dy <= radius * radius)
    return near


@kernel
def _update(track, beside, along_faces, time):
    """Fuse the flows beside a face with the velocity of its track; tell whether it moves.

    `beside` and `along_faces` (flows, chosen) are of this scan. Where none tells of it, what moves goes on: that it is
    less well known by then does not bring it to rest.
    """
    moves = track["moves"]
    if moves and time - track["told"] > UNSEEN:
        moves = False
        _forget_velocity(track)
    if moves:
        if 2 * count_flows_in_gate(track, along_faces, time) < len(along_faces[1]):
            track["cxx"] = 0.0
        fuse_faces(track, along_faces, time)
        track["moves"] = mahalanobis_from_rest(track) > RESTS or track["told"] < time
    else:
        if has_maneuvered(track, beside, time):
            _forget_velocity(track)
        fuse_flows(track, beside, time)
        track["moves"] = mahalanobis_from_rest(track) > MOVES


@kernel
def _forget_velocity(track):
    """Let a track's velocity be that of a new one: unknown."""
    track["vx"], track["vy"], track["cxx"], track["cxy"], track["cyy"] = 0.0, 0.0, 0.0, 0.0, 0.0


@kernel
def mahalanobis_from_rest(track):
    """Return the squared Mahalanobis distance of a track's velocity from rest."""
    return _squared_mahalanobis(track["vx"], track["vy"], (track["cxx"], track["cxy"], track["cyy"]))


@kernel
def _squared_mahalanobis(x, y, covariance):
    """Return the squared Mahalanobis distance of (x, y) from 0, by a covariance (xx, xy, yy)."""
    xx, xy, yy = covariance
    return (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)


@kernel
def has_maneuvered(track, measured, time):
    """Tell whether flows (flows, chosen) tell of another velocity than a track's, which seems to rest.

    Each alone may be within the gate, since a line of two echoes is noisy. What all of a scan tell is the velocity of a
    new track, which is compared with this one's. Both have errors of poses, but of different scans.
    """
    (flows, chosen), (pxx, pxy, pyy) = measured, _predicted(track, time)
    if len(chosen) < LEAST_FLOWS or track["cxx"] == 0.0:
        return False
    anything = _with_poses(flows, chosen, (ANY_SPEED**2, 0.0, ANY_SPEED**2))
    vx, vy, cxx, cxy, cyy, _ = _fused(flows, chosen, (0.0, 0.0), anything)
    both = cxx + pxx, cxy + pxy, cyy + pyy
    return _squared_mahalanobis(vx - track["vx"], vy - track["vy"], both) > MANEUVER


@kernel
def fuse_flows(track, measured, time):
    """Fuse flows (flows, chosen) with the velocity v of a track, covariance P, which seems to rest.

    The poses of both scans are wrong, so that all flows tell u = v + b, with the same b of covariance S. Before them u
    has the covariance W = P + S, after them U. With A = P W^-1, v becomes v + A (u - v), exactly, and P becomes
    P - A (W - U) A^T. A scan tells of v no better than S, but the next scan has another b.
    """
    (flows, chosen), (pxx, pxy, pyy) = measured, _predicted(track, time)
    wxx, wxy, wyy = _with_poses(flows, chosen, (pxx, pxy, pyy))
    ux, uy, cxx, cxy, cyy, count = _fused(flows, chosen, (track["vx"], track["vy"]), (wxx, wxy, wyy))
    if count > 0:
        track["told"] = time
    det = wxx * wyy - wxy * wxy
    axx, axy = (pxx * wyy - pxy * wxy) / det, (pxy * wxx - pxx * wxy) / det
    ayx, ayy = (pxy * wyy - pyy * wxy) / det, (pyy * wxx - pxy * wxy) / det
    dx, dy, dxx, dxy, dyy = ux - track["vx"], uy - track["vy"], wxx - cxx, wxy - cxy, wyy - cyy
    track["vx"], track["vy"] = track["vx"] + axx * dx + axy * dy, track["vy"] + ayx * dx + ayy * dy
    track["cxx"] = pxx - (axx * axx * dxx + 2.0 * axx * axy * dxy + axy * axy * dyy)
    track["cxy"] = pxy - (axx * ayx * dxx + (axx * ayy + axy * ayx) * dxy + axy * ayy * dyy)
    track["cyy"] = pyy - (ayx * ayx * dxx + 2.0 * ayx * ayy * dxy + ayy * ayy * dyy)


@kernel
def _fused(flows, chosen, mean, covariance):
    """Return a velocity (x, y), its covariance (xx, xy, yy) once flows are fused with it, and how many within the gate.

    `mean` (x, y) and `covariance` are what it was before [m/s], [m^2/s^2].
    """
    (ux, uy), (cxx, cxy, cyy), count = mean, covariance, 0
    for i in chosen:
        fx, fy = flows.nx[i], flows.ny[i]
        gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
        total = fx * gx + fy * gy + flows.variance[i]
        error = (flows.speed[i] - fx * ux - fy * uy) / total
        if error * error * total > OTHER:
            continue
        count += 1
        ux, uy = ux + gx * error, uy + gy * error
        cxx, cxy, cyy = cxx - gx * gx / total, cxy - gx * gy / total, cyy - gy * gy / total
    return ux, uy, cxx, cxy, cyy, count


@kernel
def _with_poses(flows, chosen, covariance):
    """Return a covariance (xx, xy, yy) and that of what poses add, the mean over the flows chosen [m^2/s^2]."""
    xx, xy, yy = covariance
    for i in chosen:
        xx, xy = xx + flows.poses_xx[i] / len(chosen), xy + flows.poses_xy[i] / len(chosen)
        yy += flows.poses_yy[i] / len(chosen)
    return xx, xy, yy


@kernel
def fuse_faces(track, measured, time):
    """Fuse flows of faces (flows, chosen) with the velocity of a track that moves.

    A flow along a normal n changes the velocity along n alone, with the gain K = n n.P n / S: by P n / S, the Kalman
    filter's, what is left of the normal's error would tell scan by scan that nothing moves along the face. The
    covariance of any gain is P - K (P n)^T - P n K^T + K S K^T (Joseph). In S the error of the pose, which all flows
    share, counts once for each of them. The flow of an end, whose direction is its beam's, has the filter's gain.
    """
    (flows, chosen), (cxx, cxy, cyy) = measured, _predicted(track, time)
    vx, vy = track["vx"], track["vy"]
    for i in chosen:
        fx, fy = flows.nx[i], flows.ny[i]
        gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
        own, error = fx * gx + fy * gy, flows.speed[i] - fx * vx - fy * vy
        if error * error > OTHER * (own + flows.variance[i] + flows.shared[i]):
            continue
        total = own + flows.variance[i] + len(chosen) * flows.shared[i]
        kx, ky = (gx / total, gy / total) if flows.of_end[i] else (own * fx / total, own * fy / total)
        track["told"] = time
        vx, vy = vx + kx * error, vy + ky * error
        cxx += kx * (total * kx - 2.0 * gx)
        cxy += total * kx * ky - kx * gy - ky * gx
        cyy += ky * (total * ky - 2.0 * gy)
    track["vx"], track["vy"], track["cxx"], track["cxy"], track["cyy"] = vx, vy, cxx, cxy, cyy


@kernel
def _predicted(track, time):
    """Return the covariance of a track's velocity at a time."""
    if track["cxx"] == 0.0:  # a new one
        return ANY_SPEED**2, 0.0, ANY_SPEED**2
    rate = WALK if track["moves"] else WALK_AT_REST
    walk = rate * rate * (time - track["time"])
    return track["cxx"] + walk, track["cxy"], track["cyy"] + walk


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
        _forget_velocity(new)
    return tracks[found]


@kernel
def count_flows_in_gate(track, beside, time):
    """Return how many flows are in a track's gate: may be of what moves as it does."""
    (flows, chosen), gate, count = beside, _gate(track, time), 0
    for i in chosen:
        count += not _is_outside(flows, i, gate)
    return count


@kernel
def flows_outside_gate(track, beside, time):
    """Return which of the flows chosen are outside a track's gate: not of what moves as it does.

    `beside` are the flows and those chosen of them, (size,).
    """
    (flows, chosen), gate, size = beside, _gate(track, time), 0
    others = np.empty(len(chosen), np.int64)
    for i in chosen:
        others[size] = i
        size += _is_outside(flows, i, gate)
    return others[:size]


@kernel
def _gate(track, time):
    """Return a track's velocity (2,) [m/s] and its covariance at a time, xx, xy and yy [m^2/s^2]."""
    return (track["vx"], track["vy"]), _predicted(track, time)


@kernel
def _is_outside(flows, i, gate):
    """Tell whether flow i is outside a gate (velocity, covariance) as `_gate` returns it."""
    ((vx, vy), (cxx, cxy, cyy)), fx, fy = gate, flows.nx[i], flows.ny[i]
    error = flows.speed[i] - fx * vx - fy * vy
    own = cxx * fx * fx + 2.0 * cxy * fx * fy + cyy * fy * fy
    return error * error > OTHER * (own + flows.variance[i] + flows.shared[i])
