"""A scan in the world frame: where the robot was when it scanned, how well it knows that, its lines and its beams.

Assumed of the pose estimate: unbiased noise, independent from camera frame to camera frame and the same for all lines
of a scan. Several scans that share a camera frame share its error, so each counts as that much worse: together they
weigh as one. A pose older than the scan is extrapolated first, see `pose_history`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario

LONGEST = 0.5  # [s] speeds are not taken over longer gaps
SPANS = 5  # frames back to which speeds are taken: 0.17 s at 30 Hz, half a period of 3 Hz
LAST = 4  # frames that tell of accelerations now
LONGEST_PERIOD = 1.0  # [s] over which accelerations are taken: robots that oscillate do so faster
FRESH = 1e-6  # [s] a pose this old is as old as the scan
NEVER_OLD = 1e9  # [s] a filter predicts poses itself: they are those of the scan

ANCHOR = np.dtype([(name, np.float64) for name in ("x", "y", "time", "known")])
"""Where a robot stood at its last scan: x, y [m], the tracks' anchor; the time of the scan [s]; known: 0 before the
first scan, then 1."""

LINE = np.dtype(
    [(name, np.float64) for name in ("angle", "offset", "c_aa", "c_ac", "c_cc", "e_aa", "e_ac", "e_cc", "low", "high")]
    + [(name, np.bool_) for name in ("free_low", "free_high")]
    + [(name, np.int64) for name in ("role", "track")],
    align=True,
)
"""One line of a scan in the world: angle of its normal [rad], offset from the robot [m]; the covariance by which they
are weighted c_aa, c_ac, c_cc (range noise and pose noise) and that of their errors e_aa, e_ac, e_cc; low and high along
t from the robot's foot [m], whether these ends are free; its role (see association.py) and its track, -1 for none
yet."""


class PoseModel(NamedTuple):
    """Noise and clock of a robot's own pose estimate."""

    position_var: float  # of one scan's pose, along each axis [m^2]
    heading_var: float  # [rad^2]
    frame_period: float  # of the camera [s]
    scan_period: float  # of the beams [s]
    timestamp_offset: float  # by how much a frame is dated too late: its delay less the delay that is assumed [s]
    step: float  # of physics, at which frames and scans are taken [s]
    shared: float  # scans that share a frame, counted in both variances
    frames: int  # to remember; 0: every scan comes with one


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
    frames = _frames(scenario, frame, scan)
    return PoseModel(shared * position_std**2, shared * heading_std**2, frame, scan, late, step, shared, frames)


def _frames(scenario: Scenario, frame_period: float, scan_period: float) -> int:
    """Return how many poses are remembered: those that last for a scan that takes time, and to extrapolate from."""
    if scenario.plant == "ideal":
        return 0
    fused, scan_time = scenario.sensors.odometry.fuse, scenario.assumed_sensors.beams.scan_time
    period = scenario.timing.tick if fused else max(frame_period, scenario.timing.tick)
    lasting = math.ceil(scan_time / period) + 2 if scan_time > 0.0 else 0
    camera, ratio = scenario.sensors.camera, scan_period / frame_period
    faults = camera.lost_frames or camera.occlusions or camera.swaps
    delay = scenario.assumed_sensors.camera.delay
    if fused or (abs(ratio - round(ratio)) < FRESH and not faults and not delay):
        return lasting
    return max(lasting, SPANS + math.ceil(delay / period) + 1 + max(LAST, math.ceil(LONGEST_PERIOD / period)))


@kernel
def pose_at_scan(estimate, variances, time, last):
    """Return the ScanPose of a scan at `time` [s] of use, and remember it in `last` (a ANCHOR).

    The `estimate` (3,) is the robot's pose when it scanned, with `variances` (2,) of position and heading.
    """
    x, y = estimate[0], estimate[1]
    shift_x, shift_y, elapsed = 0.0, 0.0, 0.0
    if last["known"] > 0:
        shift_x, shift_y, elapsed = x - last["x"], y - last["y"], time - last["time"]
    last["x"], last["y"], last["time"], last["known"] = x, y, time, 1.0
    return ScanPose(x, y, estimate[2], variances[0], variances[1], shift_x, shift_y, time, elapsed)


@kernel
def lines_in_world(lines, count, pose, errors, covariances):
    """Return the first `count` of `lines` (a LineBuffer) in the world, as records LINE (count,).

    The noise of the ScanPose `pose` is added to every line: with the robot's own position as the anchor, an error of
    the heading turns the line and an error of the position shifts it, whatever the distance, or what the
    `covariances` (L, 6) of `write_pose_covariances` tell. The `errors` (2,) are `error_variances` of position and
    heading.
    """
    turned = np.empty(count, LINE)
    for i in range(count):
        line = turned[i]
        line["angle"], line["offset"] = lines.angle[i] + pose.heading, lines.offset[i]
        aa, ac, cc = _by_poses(covariances[i], pose.position_var, pose.heading_var)
        line["c_aa"], line["c_ac"] = lines.covariance[i, 0, 0] + aa, lines.covariance[i, 0, 1] + ac
        line["c_cc"] = lines.covariance[i, 1, 1] + cc
        aa, ac, cc = _by_poses(covariances[i], errors[0], errors[1])
        line["e_aa"], line["e_ac"] = lines.error_covariance[i, 0, 0] + aa, lines.error_covariance[i, 0, 1] + ac
        line["e_cc"] = lines.error_covariance[i, 1, 1] + cc
        line["low"], line["high"] = lines.low[i], lines.high[i]
        line["free_low"], line["free_high"] = lines.free_low[i], lines.free_high[i]
        line["role"], line["track"] = 0, -1
    return turned


@kernel
def _by_poses(unit, position_var, heading_var):
    """Return the covariance aa, ac, cc of a line by poses of such variances [m^2], [rad^2], from `unit` (6,) by 1."""
    aa, ac = position_var * unit[0] + heading_var * unit[3], position_var * unit[1] + heading_var * unit[4]
    return aa, ac, position_var * unit[2] + heading_var * unit[5]


@kernel
def write_world_directions(beams, directions, heading):
    """Write the `directions` (B, 2) of a robot that heads [rad] to `beams`, in the world."""
    cos, sin = math.cos(heading), math.sin(heading)
    for k in range(len(directions)):
        beams[k, 0] = cos * directions[k, 0] - sin * directions[k, 1]
        beams[k, 1] = sin * directions[k, 0] + cos * directions[k, 1]
