"""How fast things come nearer: faces are tracked from scan to scan, each with a velocity and its covariance.

A Kalman filter whose velocity walks at random fuses the track of a face with the range flow (range_flow.py) beside the
place where the face is nearest. A face is that of a half-space, and its track, of those near that place, the one that
explains most of the flow.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.range_flow import FASTEST, free_ends, range_flow, remember

TRACK = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy", "cxx", "cxy", "cyy", "time")]
    + [(name, "?") for name in ("live", "moves")]
)
"""Nearest place of a face [m], its velocity [m/s] and covariance [m^2/s^2], when last updated [s]; whether it moves."""

TRACKS = 12  # a robot
BESIDE = 0.4  # [m] from the nearest place of a face: flows that tell of its velocity
DEPTH = 0.06  # [m] behind it: flows of the same side of a thing
JUMP = 0.5  # [m] of a nearest place from scan to scan: along a face it is where noise and beams happen to put it
UNSEEN = 1.0  # [s] after which a track ends
ANY_SPEED = 0.3  # [m/s] standard deviation of the velocity of what is seen first
WALK = 0.2  # [m/s] by which a velocity walks in a second
MOVES = 13.8  # squared Mahalanobis distance of a velocity from rest: one face at rest in a thousand is beyond it
RESTS = 2.0  # and one at which what has moved rests again: half of all that rest are within 1.4
OTHER = 9.0  # squared innovation of a flow that is not this face's: where a line joins two faces


@kernel
def closing_speeds(seen, motion, pose, parameters, half_spaces, closing):
    """Write how fast each half-space's face comes nearer along its normal, `closing` (K,) [m/s], 0 for what rests.

    `seen` are the echoes of a scan and its beams; `motion` past (lag, beams) of PAST_ECHO, past_poses (lag,) of
    PAST_POSE and tracks (T,); `half_spaces` those of `separate`: G (K, 2), h (K,), active (K,), near (K, 2). The scan
    is remembered.
    """
    (echoes, beams), (past, past_poses, tracks), (G, h, active, near) = seen, motion, half_spaces
    oldest = 0
    for i in range(len(past_poses)):
        if not past_poses[i]["known"] or (
            past_poses[oldest]["known"] and past_poses[i]["time"] < past_poses[oldest]["time"]
        ):
            oldest = i
    ends, before = free_ends(echoes, beams.ranges, parameters), (past[oldest], past_poses[oldest])
    flows, count = range_flow((echoes, beams.ranges), ends, before, pose, parameters)
    for k in range(len(h)):
        closing[k] = 0.0
        if active[k]:
            place = _nearest_place(echoes, G[k], h[k], near[k])
            closing[k] = _closing(tracks, place, (G[k, 0], G[k, 1]), (flows, count), pose.time)
    remember(past[oldest], past_poses[oldest : oldest + 1], seen, ends, pose)


@kernel
def _nearest_place(echoes, normal, h, near):
    """Return where the face of a half-space is nearest along its normal (x, y, its range's standard deviation) [m].

    Of the echoes beside `near` (2,), its place that is nearest to the robot's path: a half-space goes on for ever, its
    face does not. Where the scan has none there, that is `near` itself.
    """
    x, y, std, best = near[0], near[1], 0.0, math.inf
    for i in range(len(echoes.x)):
        if echoes.binds[i]:
            along = normal[0] * echoes.x[i] + normal[1] * echoes.y[i]
            if h < along < best:
                dx, dy = echoes.x[i] - near[0], echoes.y[i] - near[1]
                if dx * dx + dy * dy <= BESIDE * BESIDE:
                    x, y, std, best = echoes.x[i], echoes.y[i], math.sqrt(echoes.variance[i]), along
    return x, y, std


@kernel
def _closing(tracks, place, normal, measured, time):
    """Return how fast the face of a place (x, y, its range's standard deviation) comes along -normal [m/s].

    `measured` are the flows of the scan, a `RangeFlow`, and their count. It is 0 until the track is known to move, then
    a standard deviation more than estimated.
    """
    (x, y, _), (nx, ny), (flows, count) = place, normal, measured
    beside = _beside(flows, count, place, normal)
    track = _track_of(tracks, (x, y), (flows, beside), time)
    if track["time"] < time or track["cxx"] == 0.0:
        _update(track, flows, beside, time)
        track["x"], track["y"], track["time"] = x, y, time
    speed = -(nx * track["vx"] + ny * track["vy"])
    variance = nx * nx * track["cxx"] + 2.0 * nx * ny * track["cxy"] + ny * ny * track["cyy"]
    return min(max(speed + math.sqrt(variance), 0.0), FASTEST) if track["moves"] else 0.0


@kernel
def _beside(flows, count, place, normal):
    """Return which flows are beside the place of a face (x, y, its std), and on its side."""
    (x, y, std), (nx, ny) = place, normal
    beside, size = np.empty(count, np.int64), 0
    for i in range(count):
        dx, dy = flows.x[i] - x, flows.y[i] - y
        if dx * dx + dy * dy <= BESIDE * BESIDE and nx * dx + ny * dy <= DEPTH + 2.0 * std:
            beside[size] = i
            size += 1
    return beside[:size]


@kernel
def _update(track, flows, beside, time):
    """Fuse the flows beside a face with the velocity of its track; tell whether it moves."""
    cxx, cxy, cyy = _predicted(track, time)
    vx, vy, shared = track["vx"], track["vy"], 0.0
    for i in beside:
        fx, fy = flows.nx[i], flows.ny[i]
        gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
        total = fx * gx + fy * gy + flows.variance[i]
        error = (flows.speed[i] - fx * vx - fy * vy) / total
        if error * error * total > OTHER:
            continue
        vx, vy = vx + gx * error, vy + gy * error
        cxx, cxy, cyy = cxx - gx * gx / total, cxy - gx * gy / total, cyy - gy * gy / total
        shared = max(shared, flows.shared[i])
    track["vx"], track["vy"], track["cxx"], track["cxy"], track["cyy"] = vx, vy, cxx, cxy, cyy
    cxx, cyy = cxx + shared, cyy + shared
    distance = (cyy * vx * vx - 2.0 * cxy * vx * vy + cxx * vy * vy) / (cxx * cyy - cxy * cxy)
    track["moves"] = distance > (RESTS if track["moves"] else MOVES)


@kernel
def _predicted(track, time):
    """Return the covariance of a track's velocity at a time."""
    if track["cxx"] == 0.0:  # a new one
        return ANY_SPEED**2, 0.0, ANY_SPEED**2
    walk = WALK * WALK * (time - track["time"])
    return track["cxx"] + walk, track["cxy"], track["cyy"] + walk


@kernel
def _track_of(tracks, place, beside, time):
    """Return the track of a face: of those near its place the one that explains most of the flows beside it.

    `place` (x, y) [m]; `beside` (flows, chosen) as for `_explained`. One that explains less than half of them is
    another face's. Where none is left, a new one is begun.
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
                explained = _explained(track, beside, time)
                if explained > most or (explained == most and squared < best):
                    best, most, found = squared, explained, i
        if not track["live"] or (tracks[free]["live"] and track["time"] < tracks[free]["time"]):
            free = i
    if found < 0:
        found = free
        new = tracks[found]
        new["x"], new["y"], new["vx"], new["vy"], new["time"], new["live"] = place[0], place[1], 0.0, 0.0, time, True
        new["moves"] = False
        new["cxx"], new["cxy"], new["cyy"] = 0.0, 0.0, 0.0
    return tracks[found]


@kernel
def _explained(track, beside, time):
    """Return how many flows may be of what moves as a track does.

    `beside` are the flows and those chosen of them, (size,).
    """
    (flows, chosen), (cxx, cxy, cyy), count = beside, _predicted(track, time), 0
    for i in chosen:
        fx, fy = flows.nx[i], flows.ny[i]
        error = flows.speed[i] - fx * track["vx"] - fy * track["vy"]
        own = cxx * fx * fx + 2.0 * cxy * fx * fy + cyy * fy * fy
        count += error * error <= OTHER * (own + flows.variance[i] + flows.shared[i])
    return count
