"""How fast things come nearer: faces are tracked from scan to scan, each with a velocity and its covariance.

An echo is held against a scan some 0.3 s older. The two echoes that were then on either side of its direction span a
line; how far the new echo lies off that line is how far the face has moved along its normal, the normal flow (Horn and
Schunck, Artificial Intelligence 17, 1981; in scan matching the point-to-line metric of Censi, ICRA 2008). The flows
beside the nearest place of a face and the track of that place are fused by a Kalman filter whose velocity walks at
random. A wall along which a robot drives has no flow along its normal, whatever comes into view, so it stays at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import beams_beside
from pbrg_mj.perception.points.parameters import JOINING, LEAST_JOINING

PAST = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("range", "f8"),
        ("variance", "f8"),
        ("off_line", "f8"),
        ("dx", "f8"),
        ("dy", "f8"),
        ("heard", "?"),
    ]
)
"""An echo of an older scan: place, range [m], the range's variance [m^2], how far it may lie off its face [m]
(anywhere up to there: a variance of a twelfth of its square), direction of its beam in the body frame."""
PLACE = np.dtype([("x", "f8"), ("y", "f8"), ("heading", "f8"), ("time", "f8"), ("known", "?")])
"""Where the robot was then."""
TRACK = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy", "cxx", "cxy", "cyy", "time")]
    + [(name, "?") for name in ("live", "moves")]
)
"""Nearest place of a face [m], its velocity [m/s] and covariance [m^2/s^2], when last updated [s]; whether it moves."""

TRACKS = 12  # a robot
NEAR = 1.5  # [m] farther things have time to come nearer
BESIDE = 0.4  # [m] from the nearest place of a face: flows that tell of its velocity
DEPTH = 0.06  # [m] behind it: flows of the same side of a thing
JUMP = 0.5  # [m] of a nearest place from scan to scan: along a face it is where noise and beams happen to put it
UNSEEN = 1.0  # [s] after which a track ends
ANY_SPEED = 0.3  # [m/s] standard deviation of the velocity of what is seen first
FASTEST = 0.7  # [m/s] more is no motion, but another thing
WALK = 0.2  # [m/s] by which a velocity walks in a second
MOVES = 13.8  # squared Mahalanobis distance of a velocity from rest: one face at rest in a thousand is beyond it
RESTS = 2.0  # and one at which what has moved rests again: half of all that rest are within 1.4
OTHER = 9.0  # squared innovation of a flow that is not this face's: where a line joins two faces
SLANTED = 0.5  # cosine between a face's normal and its beam below which normal flow tells little


class Flows(NamedTuple):
    """Normal flow of echoes; functions look at the first entries of each array."""

    x: np.ndarray  # (F,) [m]
    y: np.ndarray  # (F,) [m]
    nx: np.ndarray  # (F,) normal, towards the robot
    ny: np.ndarray  # (F,)
    speed: np.ndarray  # (F,) along it [m/s]
    variance: np.ndarray  # (F,) of its own [m^2/s^2]
    shared: np.ndarray  # (F,) of the poses, the same for all of a scan [m^2/s^2]


@kernel
def closing_speeds(seen, motion, pose, parameters, half_spaces, closing):
    """Write how fast each half-space's face comes nearer along its normal, `closing` (K,) [m/s], 0 for what rests.

    `seen` are the `Echoes` of a scan and its `SeenBeams`, `motion` PAST (lag, beams), PLACE (lag,), TRACK (T,) of a
    robot, `half_spaces` G, h, active. The scan is remembered.
    """
    (echoes, beams), (past, places, tracks), (G, h, active) = seen, motion, half_spaces
    oldest = 0
    for i in range(len(places)):
        if not places[i]["known"] or (places[oldest]["known"] and places[i]["time"] < places[oldest]["time"]):
            oldest = i
    flows, count = _normal_flow(echoes, beams.ranges, (past[oldest], places[oldest]), pose, parameters)
    for k in range(len(h)):
        closing[k] = 0.0
        if active[k]:
            nearest = _nearest_echo(echoes, G[k], h[k])
            if nearest >= 0:
                place = echoes.x[nearest], echoes.y[nearest], math.sqrt(echoes.variance[nearest])
                closing[k] = _closing(tracks, place, (G[k, 0], G[k, 1]), (flows, count), pose.time)
    _remember(past[oldest], places[oldest : oldest + 1], echoes, beams, pose)


@kernel
def _nearest_echo(echoes, normal, h):
    """Return the echo just beyond a half-space that is nearest along its normal, -1 where the scan has none."""
    nearest, best = -1, h + BESIDE
    for i in range(len(echoes.x)):
        if echoes.heard[i]:
            along = normal[0] * echoes.x[i] + normal[1] * echoes.y[i]
            if h < along < best:
                nearest, best = i, along
    return nearest


@kernel
def _normal_flow(echoes, ranges, before, pose, parameters):
    """Return the `Flows` of a scan's near echoes against an older one, and how many there are."""
    beams, count = len(ranges), 0
    x, y, nx, ny = np.empty(beams), np.empty(beams), np.empty(beams), np.empty(beams)
    flows = Flows(x, y, nx, ny, np.empty(beams), np.empty(beams), np.empty(beams))
    past, place = before
    elapsed = pose.time - place["time"]
    if not place["known"] or not 0.0 < elapsed <= UNSEEN:
        return flows, 0
    directions = _directions(past, parameters)
    for i in range(beams):
        if not echoes.heard[i] or ranges[i] > NEAR:
            continue
        dx, dy = echoes.x[i] - place["x"], echoes.y[i] - place["y"]
        a, b = beams_beside(dx, dy, place["heading"], directions, parameters)
        if b < 0 or not (past[a]["heard"] and past[b]["heard"]):
            continue
        along_x, along_y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
        length, far = math.sqrt(along_x * along_x + along_y * along_y), max(past[a]["range"], past[b]["range"])
        noise = past[a]["variance"] + past[b]["variance"]
        # by the farther range, unlike in `detect`: more lines tell of rest, and gates drop those from thing to thing
        if length == 0.0 or length > max(JOINING * parameters.gap * far, LEAST_JOINING) + 3.0 * math.sqrt(noise):
            continue
        ux, uy = -along_y / length, along_x / length
        if ux * dx + uy * dy > 0.0:
            ux, uy = -ux, -uy
        moved = (echoes.x[i] - past[a]["x"]) * ux + (echoes.y[i] - past[a]["y"]) * uy
        slanted = -(ux * dx + uy * dy) < SLANTED * math.sqrt(dx * dx + dy * dy)
        if slanted or abs(moved) > FASTEST * elapsed + 3.0 * math.sqrt(echoes.variance[i]):
            continue
        variance = echoes.variance[i] + 0.5 * noise + max(past[a]["off_line"], past[b]["off_line"]) ** 2 / 12.0
        x[count], y[count], nx[count], ny[count] = echoes.x[i], echoes.y[i], ux, uy
        flows.speed[count], flows.variance[count] = moved / elapsed, (variance + 1e-6) / elapsed**2
        flows.shared[count] = 2.0 * echoes.pose_std[i] ** 2 / elapsed**2
        count += 1
    return flows, count


@kernel
def _directions(past, parameters):
    """Return the directions (beams, 2) of an older scan's beams; those of all scans where a scan takes no time."""
    if not parameters.scan_time > 0.0:
        return parameters.directions
    directions = np.empty((len(past), 2))
    for k in range(len(past)):
        directions[k, 0], directions[k, 1] = past[k]["dx"], past[k]["dy"]
    return directions


@kernel
def _closing(tracks, place, normal, measured, time):
    """Return how fast the face of a place (x, y, its range's standard deviation) comes along -normal [m/s].

    It is 0 until the track is known to move, then a standard deviation more than estimated.
    """
    x, y, std = place
    (nx, ny), (flows, count) = normal, measured
    track = _track_of(tracks, x, y, time)
    shared = 0.0
    if track["time"] < time or track["cxx"] == 0.0:
        walk = WALK * WALK * (time - track["time"])
        cxx, cxy, cyy = track["cxx"] + walk, track["cxy"], track["cyy"] + walk
        if track["cxx"] == 0.0:  # a new one
            cxx, cxy, cyy = ANY_SPEED**2, 0.0, ANY_SPEED**2
        vx, vy = track["vx"], track["vy"]
        for i in range(count):
            dx, dy = flows.x[i] - x, flows.y[i] - y
            if dx * dx + dy * dy > BESIDE * BESIDE or nx * dx + ny * dy > DEPTH + 2.0 * std:
                continue
            fx, fy = flows.nx[i], flows.ny[i]
            gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
            total = fx * gx + fy * gy + flows.variance[i]
            error = (flows.speed[i] - fx * vx - fy * vy) / total
            if error * error * total > OTHER:
                continue
            vx, vy = vx + gx * error, vy + gy * error
            cxx, cxy, cyy = cxx - gx * gx / total, cxy - gx * gy / total, cyy - gy * gy / total
            shared = max(shared, flows.shared[i])
        track["x"], track["y"], track["vx"], track["vy"], track["time"] = x, y, vx, vy, time
        track["cxx"], track["cxy"], track["cyy"] = cxx, cxy, cyy
        cxx, cyy = cxx + shared, cyy + shared
        distance = (cyy * vx * vx - 2.0 * cxy * vx * vy + cxx * vy * vy) / (cxx * cyy - cxy * cxy)
        track["moves"] = distance > (RESTS if track["moves"] else MOVES)
    speed = -(nx * track["vx"] + ny * track["vy"])
    variance = nx * nx * track["cxx"] + 2.0 * nx * ny * track["cxy"] + ny * ny * track["cyy"]
    return min(max(speed + math.sqrt(variance), 0.0), FASTEST) if track["moves"] else 0.0


@kernel
def _track_of(tracks, x, y, time):
    """Return the track that is nearest to a place, a new one if none is near."""
    best, found, free = JUMP * JUMP, -1, 0
    for i in range(len(tracks)):
        track = tracks[i]
        if track["live"] and time - track["time"] > UNSEEN:
            track["live"] = False
        if track["live"]:
            ahead = time - track["time"]
            dx, dy = track["x"] + ahead * track["vx"] - x, track["y"] + ahead * track["vy"] - y
            if dx * dx + dy * dy < best:
                best, found = dx * dx + dy * dy, i
        if not track["live"] or (tracks[free]["live"] and track["time"] < tracks[free]["time"]):
            free = i
    if found < 0:
        found = free
        new = tracks[found]
        new["x"], new["y"], new["vx"], new["vy"], new["time"], new["live"] = x, y, 0.0, 0.0, time, True
        new["moves"] = False
        new["cxx"], new["cxy"], new["cyy"] = 0.0, 0.0, 0.0
    return tracks[found]


@kernel
def _remember(past, place, echoes, beams, pose):
    """Write a scan over the oldest one."""
    for i in range(len(past)):
        past[i]["x"], past[i]["y"], past[i]["heard"] = echoes.x[i], echoes.y[i], echoes.heard[i]
        past[i]["dx"], past[i]["dy"] = beams.directions[i, 0], beams.directions[i, 1]
        past[i]["range"], past[i]["variance"], past[i]["off_line"] = (
            beams.ranges[i],
            echoes.variance[i],
            echoes.bulge[i],
        )
    place[0]["x"], place[0]["y"], place[0]["heading"] = pose.x, pose.y, pose.heading
    place[0]["time"], place[0]["known"] = pose.time, True
