"""Points of what moves, where it is nearer than beams tell: they go on with it.

A beam has no echo of what is nearer than its shortest range, and no scan shows such a point gone (memory.py). What
rests stays there. What moves does not: its points are given the velocity of their face's track (face_track.py) while
they are seen, and are moved by it while they are not. What comes slowly has to be less sure to move before it vanishes
than elsewhere, since no later scan will tell.
"""

from __future__ import annotations

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face_track import any_moving, mahalanobis_from_rest
from pbrg_mj.perception.points.memory import blind_zone_radius
from pbrg_mj.perception.points.motion import BESIDE
from pbrg_mj.perception.points.normal_flow import FASTEST

MOVES_UNSEEN = 5.0  # squared Mahalanobis distance from rest of what comes and may not be seen again: one in twelve


@kernel
def predict_blind_zone_points(points, pose, parameters):
    """Move the points that are nearer than beams tell by their velocity since the last scan."""
    if not blind_zone_margin(parameters) > 0.0:
        return
    for i in range(len(points)):
        point = points[i]
        if point["live"] and (point["vx"] != 0.0 or point["vy"] != 0.0):
            dx, dy = point["x"] - pose.x, point["y"] - pose.y
            if dx * dx + dy * dy <= blind_zone_radius(point, parameters) ** 2:
                point["x"] += pose.elapsed * point["vx"]
                point["y"] += pose.elapsed * point["vy"]


@kernel
def blind_zone_margin(parameters):
    """Return how much farther than the clearance a hand point must stay off what no heading may bring too near [m]."""
    return max(parameters.range_min + parameters.hand_offset - parameters.clearance, 0.0)


@kernel
def assign_velocities(points, scan, flows_of_faces, tracks, pose, parameters):
    """Give the points of a scan that may be too near at the next one the velocity of what they are of.

    What comes slowly moves first, if it may not be seen again. A point is of a track that moves if the flow of its echo
    is nearer to the track's than to that of what rests. `flows_of_faces` are those of `face_flow`, and how many.
    """
    if not blind_zone_margin(parameters) > 0.0:
        return
    reach = parameters.range_min + FASTEST * pose.elapsed
    _suspect_what_vanishes(tracks, pose, reach)
    if not any_moving(tracks):
        return
    for i in range(len(points)):
        point = points[i]
        if point["live"] and point["scan"] == scan:
            dx, dy = point["x"] - pose.x, point["y"] - pose.y
            if dx * dx + dy * dy <= reach * reach:
                point["vx"], point["vy"] = _velocity(point, flows_of_faces, tracks)


@kernel
def _suspect_what_vanishes(tracks, pose, reach):
    """Let tracks move that come and are within reach [m], of which this scan has told, and beyond `MOVES_UNSEEN`."""
    for t in range(len(tracks)):
        track = tracks[t]
        if track["live"] and track["time"] == pose.time:
            dx, dy = track["x"] - pose.x, track["y"] - pose.y
            comes = dx * track["vx"] + dy * track["vy"] < 0.0 and dx * dx + dy * dy <= reach * reach
            track["moves"] = track["moves"] or (comes and mahalanobis_from_rest(track) > MOVES_UNSEEN)


@kernel
def _velocity(point, flows_of_faces, tracks):
    """Return the velocity (2,) of the track whose flow a point's is nearest to [m/s], 0 of what rests."""
    (flows, count), vx, vy = flows_of_faces, 0.0, 0.0
    for k in range(count):
        if flows.x[k] == point["x"] and flows.y[k] == point["y"] and not flows.of_end[k]:
            least = abs(flows.speed[k])
            for t in range(len(tracks)):
                track = tracks[t]
                if track["live"] and track["moves"]:
                    dx, dy = track["x"] - point["x"], track["y"] - point["y"]
                    error = abs(flows.speed[k] - flows.nx[k] * track["vx"] - flows.ny[k] * track["vy"])
                    if dx * dx + dy * dy <= BESIDE * BESIDE and error < least:
                        least, vx, vy = error, track["vx"], track["vy"]
            break
    return vx, vy
