"""Older scans of a robot: what flows are measured against."""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel

PAST_ECHO = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("range", "f8"),
        ("variance", "f8"),
        ("off_line", "f8"),
        ("dx", "f8"),
        ("dy", "f8"),
        ("ends", "i8"),
        ("external", "?"),
    ]
)
"""An echo of an older scan: place, range [m], the range's variance [m^2], how far it may lie off its face [m]
(anywhere up to there: a variance of a twelfth of its square), direction of its beam in the body frame, `free_ends`."""
PAST_POSE = np.dtype([("x", "f8"), ("y", "f8"), ("heading", "f8"), ("time", "f8"), ("known", "?")])
"""Where the robot was then [m], [rad], when [s], and whether there is such a scan."""

LONGEST = 1.0  # [s] between two scans that are compared


@kernel
def scans_by_age(past_poses):
    """Return which older scans there are, the oldest first; none before the second scan.

    `past_poses` (lag,) are of PAST_POSE.
    """
    order, size = np.empty(len(past_poses), np.int64), 0
    for i in range(len(past_poses)):
        if past_poses[i]["known"]:
            k = size
            while k > 0 and past_poses[order[k - 1]]["time"] > past_poses[i]["time"]:
                order[k] = order[k - 1]
                k -= 1
            order[k] = i
            size += 1
    return order[:size]


@kernel
def directions_of(past, parameters):
    """Return the directions (beams, 2) of an older scan's beams; those of all scans where a scan takes no time."""
    if not parameters.scan_time > 0.0:
        return parameters.directions
    directions = np.empty((len(past), 2))
    for k in range(len(past)):
        directions[k, 0], directions[k, 1] = past[k]["dx"], past[k]["dy"]
    return directions


@kernel
def store_scan(past, past_pose, seen, ends, pose):
    """Write a scan over the oldest one, past (beams,) of PAST_ECHO and past_pose (1,) of PAST_POSE.

    `seen` are its Echoes and SeenBeams, `ends` (beams,) those of `free_ends`.
    """
    echoes, beams = seen
    for i in range(len(past)):
        past[i]["x"], past[i]["y"], past[i]["external"] = echoes.x[i], echoes.y[i], echoes.external[i]
        past[i]["dx"], past[i]["dy"] = beams.directions[i, 0], beams.directions[i, 1]
        past[i]["ends"] = ends[i]
        past[i]["range"], past[i]["variance"], past[i]["off_line"] = (
            beams.ranges[i],
            echoes.variance[i],
            echoes.protrusion[i],
        )
    past_pose[0]["x"], past_pose[0]["y"], past_pose[0]["heading"] = pose.x, pose.y, pose.heading
    past_pose[0]["time"], past_pose[0]["known"] = pose.time, True
