"""A scan in the world frame: where the robot was when it scanned, how well it knows that, its lines and its beams.

Assumed of the pose estimate: unbiased noise, independent from camera frame to camera frame and the same for all lines
of a scan. Several scans that share a camera frame share its error, so each counts as that much worse: together they
weigh as one. A pose older than the scan is carried on at the speed since the last scan; half of that way counts as
one more standard deviation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped
from pbrg_mj.scenario.schema import Scenario

LONGEST = 0.5  # [s] speeds are not taken over longer gaps
NEVER_OLD = 1e9  # [s] a filter carries poses on by itself: they are those of the scan
FRESH = 1e-6  # [s] a pose this old is as old as the scan

ANCHOR = np.dtype(
    [(name, np.float64) for name in ("x", "y", "est_x", "est_y", "est_heading", "exposed", "time", "known")]
)
"""Where a robot stood at its last scan: x, y [m], the tracks' anchor; the camera's estimate [m], [rad] and when it was
exposed [s]; the time of the scan [s]; known: 0 before the first scan, then 1."""

LINE = np.dtype(
    [(name, np.float64) for name in ("angle", "offset", "c_aa", "c_ac", "c_cc", "low", "high")]
    + [(name, np.bool_) for name in ("free_low", "free_high")]
    + [(name, np.int64) for name in ("role", "track")],
    align=True,
)
"""One line of a scan in the world: angle of its normal [rad], offset from the robot [m], their covariance c_aa, c_ac,
c_cc (range noise and pose noise), low and high along t from the robot's foot [m], whether these ends are free; its role
(see association.py) and its track, -1 for none yet."""


class PoseModel(NamedTuple):
    """Noise and clock of a robot's own pose estimate."""

    position_var: float  # of one scan's pose, along each axis [m^2]
    heading_var: float  # [rad^2]
    frame_period: float  # of the camera [s]
    scan_period: float  # of the beams [s]
    dated_late: float  # by how much a frame is dated too late: its delay less the delay that is assumed [s]


class Clock(NamedTuple):
    """When a scan and the pose that goes with it were taken."""

    pose_frame: int
    scan_frame: int
    time: float  # of use [s]


class ScanPose(NamedTuple):
    """A robot's pose at its scan."""

    x: float  # [m]
    y: float  # [m]
    heading: float  # [rad]
    position_var: float  # [m^2]
    heading_var: float  # [rad^2]
    shift_x: float  # since the last scan [m]
    shift_y: float  # [m]
    time: float  # [s]
    elapsed: float  # since the last scan [s]


def pose_model(scenario: Scenario) -> PoseModel:
    """Return the pose model for a scenario."""
    step, camera, beams = scenario.timing.physics_step, scenario.assumed_sensors.camera, scenario.sensors.beams
    exact = scenario.plant == "ideal"
    position_std = 0.0 if exact else camera.position_std
    heading_std = 0.0 if exact else math.radians(camera.heading_std_deg)
    frame, scan = max(1 / camera.rate_hz, step), max(1 / beams.rate_hz, step)
    shared = max(1.0, frame / scan)
    late = scenario.sensors.camera.delay - camera.delay
    if scenario.sensors.odometry.fuse:
        late = NEVER_OLD
    return PoseModel(shared * position_std**2, shared * heading_std**2, frame, scan, late)


@kernel
def pose_at_scan(estimate, clock, last, model):
    """Return the ScanPose of a scan from the `estimate` (3,) of the camera, and remember it in `last` (a ANCHOR)."""
    exposed = clock.pose_frame * model.frame_period + model.dated_late
    age = min(max(clock.scan_frame * model.scan_period - exposed, 0.0), LONGEST)
    x, y, heading = estimate[0], estimate[1], estimate[2]
    position_var, heading_var = model.position_var, model.heading_var
    gap = exposed - last["exposed"]
    if last["known"] > 0 and age > FRESH and 0 < gap <= LONGEST:
        ratio = age / gap
        dx, dy = ratio * (x - last["est_x"]), ratio * (y - last["est_y"])
        turn = ratio * wrapped(heading - last["est_heading"])
        x, y, heading = x + dx, y + dy, heading + turn
        position_var = (1 + 2 * ratio**2) * position_var + 0.25 * (dx**2 + dy**2)
        heading_var = (1 + 2 * ratio**2) * heading_var + 0.25 * turn**2
    shift_x, shift_y, elapsed = 0.0, 0.0, 0.0
    if last["known"] > 0:
        shift_x, shift_y, elapsed = x - last["x"], y - last["y"], clock.time - last["time"]
    last["x"], last["y"], last["time"], last["known"] = x, y, clock.time, 1.0
    last["est_x"], last["est_y"], last["est_heading"], last["exposed"] = (
        estimate[0],
        estimate[1],
        estimate[2],
        exposed,
    )
    return ScanPose(x, y, heading, position_var, heading_var, shift_x, shift_y, clock.time, elapsed)


@kernel
def lines_in_world(lines, count, pose):
    """Return the first `count` of `lines` (a LineBuffer) in the world, as records LINE (count,).

    The noise of the ScanPose `pose` is added to every line: with the robot's own position as the anchor, an error of
    the heading turns the line and an error of the position shifts it, whatever the distance.
    """
    turned = np.empty(count, LINE)
    for i in range(count):
        line = turned[i]
        line["angle"], line["offset"] = lines.angle[i] + pose.heading, lines.offset[i]
        line["c_aa"], line["c_ac"] = lines.covariance[i, 0, 0] + pose.heading_var, lines.covariance[i, 0, 1]
        line["c_cc"] = lines.covariance[i, 1, 1] + pose.position_var
        line["low"], line["high"] = lines.low[i], lines.high[i]
        line["free_low"], line["free_high"] = lines.free_low[i], lines.free_high[i]
        line["role"], line["track"] = 0, -1
    return turned


@kernel
def write_world_directions(beams, directions, heading):
    """Write the `directions` (B, 2) of a robot that heads [rad] to `beams`, in the world."""
    cos, sin = math.cos(heading), math.sin(heading)
    for k in range(len(directions)):
        beams[k, 0] = cos * directions[k, 0] - sin * directions[k, 1]
        beams[k, 1] = sin * directions[k, 0] + cos * directions[k, 1]
