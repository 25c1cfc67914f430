"""Where robots were at a scan, from the camera's last frames, and how uncertain that is.

A pose that is older than the scan is extrapolated at the constant twist over a span of frames. With the noise sigma of
a frame, the span S, the age a and r = a / S, the noise of the result has the variance sigma^2 ((1 + r)^2 + r^2). The
error by accelerations is measured: each frame of the last second is predicted from the frames before it in the same
way, and the squared error less its noise counts. A unit acceleration gives an error of a (a + S) / 2, by which errors
over other ages are scaled to this one. The span is the one of least variance: a short one has more of the noise, a long
one more of the acceleration.

A mean of noisy squares less their noise may be negative. Cut at 0 it is too large in the mean, by a tenth of sigma^2 at
an age of 26 ms where nothing accelerates; sightings are weighted by that. Where scan after scan is averaged the mean of
the variances counts, so those of the errors have the mean as it is, which is unbiased.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped
from pbrg_mj.perception.track.world_frame import FRESH, LAST, LONGEST, SPANS, PoseModel
from pbrg_mj.sensing.readings import Readings

STRAIGHT = 1e-9  # [rad] what turns by less goes straight


class PoseHistory(NamedTuple):
    """Poses from the camera, oldest first; none where all scans come with frames. Never written to."""

    time: np.ndarray  # (H,) when robots were there [s]; -inf: nothing yet
    poses: np.ndarray  # (H, n, 3) x, y [m], heading [rad]


class PosesAtScan(NamedTuple):
    """Where robots were at a scan."""

    poses: np.ndarray  # (n, 3) x, y [m], heading [rad]
    variances: np.ndarray  # (n, 2) of x and y each [m^2], of the heading [rad^2], with what accelerations add at most
    error_variances: np.ndarray  # (n, 2) the same with what they add in the mean, unbiased; a frame's at least


def no_poses(robots: int, frames: int) -> PoseHistory:
    """Return an empty history of so many frames."""
    return PoseHistory(np.full(frames, -math.inf), np.full((frames, robots, 3), np.nan))


def exposure(frame: int, model: PoseModel) -> float:
    """Return when a frame was exposed [s], by the delay that is assumed: at the first physics step that it is due."""
    return _due(frame * model.frame_period, model.step) + model.timestamp_offset


def scanned(frame: int, model: PoseModel) -> float:
    """Return when a scan was taken [s]."""
    return _due(frame * model.scan_period, model.step)


def _due(time: float, step: float) -> float:
    return math.ceil(time / step - FRESH) * step


def with_poses(history: PoseHistory, readings: Readings, time: float, model: PoseModel) -> PoseHistory:
    """Return the history with the readings' poses at `time` [s]; the same one if it has them already.

    Before the first frame robots were where they are then.
    """
    if not len(history.time) or readings.pose_frame < 0:
        return history
    exposed_at = min(exposure(readings.pose_frame, model), time)
    if exposed_at <= history.time[-1]:
        return history
    if history.time[-1] == -math.inf:
        count = len(history.time)
        times = exposed_at - model.frame_period * np.arange(count - 1, -1, -1)
        return PoseHistory(times, np.repeat(readings.body_pose[None], count, axis=0))
    return PoseHistory(
        np.append(history.time[1:], exposed_at), np.concatenate([history.poses[1:], readings.body_pose[None]])
    )


def poses_at_scan(history: PoseHistory, readings: Readings, model: PoseModel) -> PosesAtScan:
    """Return where robots were when the readings' scan was taken."""
    age = scanned(readings.scan_frame, model) - exposure(readings.pose_frame, model)
    if age <= FRESH or len(history.time) < SPANS + 2 or readings.pose_frame < 0:
        poses, variances = readings.body_pose, np.empty((len(readings.body_pose), 2))
        variances[:, 0], variances[:, 1] = model.position_var, model.heading_var
        return PosesAtScan(poses, variances, variances)
    return extrapolated(history, min(age, max(LONGEST, SPANS * model.frame_period)), model)


def extrapolated(history: PoseHistory, age: float, model: PoseModel) -> PosesAtScan:
    """Return where robots are `age` [s] after the last frame of a history."""
    time, poses = history
    found, variances, errors = np.empty(poses.shape[1:]), np.empty((poses.shape[1], 2)), np.empty((poses.shape[1], 2))
    noise = model.position_var / model.shared, model.heading_var / model.shared
    ahead = math.ceil(age / model.frame_period - FRESH)  # frames that last for the age
    ahead = min(max(ahead, 1), len(time) - 1 - SPANS)
    for robot in range(len(found)):
        one = poses[:, robot].copy()
        _extrapolate((time, one), (age, ahead), noise, (found[robot], variances[robot], errors[robot]))
    return PosesAtScan(found, model.shared * variances, model.shared * errors)


@kernel
def _extrapolate(frames, over, noise, written):
    """Write a robot's pose, found (3,), the variances (2,) of its x and y each and its heading, and errors (2,).

    Those are the variances with what accelerations add in the mean over all frames that measured some.

    `frames` are time (H,) [s] and poses (H, 3), whose headings are unwound in place; `over` an age [s] and how many
    frames last for it, ahead; noise (2,) are the variances of a frame, [m^2] and [rad^2].
    """
    (time, poses), (age, ahead), (found, variances, errors) = frames, over, written
    last = len(time) - 1
    for k in range(last):
        poses[k + 1, 2] = poses[k, 2] + wrapped(poses[k + 1, 2] - poses[k, 2])
    variances[0], variances[1] = math.inf, math.inf
    for back in range(1, SPANS + 1):
        span = time[last] - time[last - back]
        if back > 1 and span > LONGEST:
            break
        x, y, heading = _along(poses[last], poses[last - back], age / span)
        at_most, mean = _errors(time, poses, (ahead, back), noise, age * (age + span))
        own = _noise(age / span)
        if own * noise[0] + at_most[0] < variances[0]:
            found[0], found[1], variances[0] = x, y, own * noise[0] + at_most[0]
            errors[0] = max(own * noise[0] + mean[0], noise[0])
        if own * noise[1] + at_most[1] < variances[1]:
            found[2], variances[1] = heading, own * noise[1] + at_most[1]
            errors[1] = max(own * noise[1] + mean[1], noise[1])


@kernel
def _errors(time, poses, apart, noise, drawn):
    """Return mean squared errors by accelerations, of x and y each [m^2] and of the heading [rad^2].

    Frames are predicted from those `ahead` before them and `back` more. Of the means over all and over the last the
    larger counts: that of all covers robots that begin to turn within the age, that of the last those that turn now.
    The mean over all that were measured follows, of both, which may be negative. A frame that repeats the one before,
    as those before the first frame do, measures nothing; of fewer than LAST measured it is that over all, cut at 0.
    """
    ahead, back = apart
    place, heading, place_now, heading_now = 0.0, 0.0, 0.0, 0.0
    measured, measured_place, measured_heading = 0, 0.0, 0.0
    count = len(time) - ahead - back
    for k in range(count - 1, -1, -1):
        middle, end = k + back, k + back + ahead
        age, span = time[end] - time[middle], time[middle] - time[k]
        own, scale = _noise(age / span) + 1.0, (drawn / (age * (age + span))) ** 2
        x, y, theta = _along(poses[middle], poses[k], age / span)
        x, y, theta = poses[end, 0] - x, poses[end, 1] - y, poses[end, 2] - theta
        of_place = scale * (0.5 * (x * x + y * y) - own * noise[0])
        of_heading = scale * (theta * theta - own * noise[1])
        place, heading = place + of_place, heading + of_heading
        if not _repeats(poses[end], poses[end - 1]) and not _repeats(poses[k + 1], poses[k]):
            measured += 1
            measured_place, measured_heading = measured_place + of_place, measured_heading + of_heading
        if k == max(count - LAST, 0):
            place_now, heading_now = place / (count - k), heading / (count - k)
    place, heading = max(place / count, 0.0), max(heading / count, 0.0)
    at_most = max(place, place_now), max(heading, heading_now)
    if measured < LAST:
        return at_most, (place, heading)
    return at_most, (measured_place / measured, measured_heading / measured)


@kernel
def _repeats(pose, before):
    """Return whether a pose (3,) is the one before (3,) again: noise makes every measured one another."""
    return pose[0] == before[0] and pose[1] == before[1]


@kernel
def _noise(ratio):
    """Return the variance of an extrapolation by a ratio of its span, from poses whose variance is 1."""
    return (1.0 + ratio) ** 2 + ratio**2


@kernel
def _along(pose, before, ratio):
    """Return x, y and heading of a pose (3,) that goes on by a ratio of the twist since the pose before (3,)."""
    x, y, turn = pose[0] - before[0], pose[1] - before[1], pose[2] - before[2]
    chord = ratio
    if abs(turn) > STRAIGHT:
        chord = math.sin(0.5 * ratio * turn) / math.sin(0.5 * turn)
    cos, sin = chord * math.cos(0.5 * (1.0 + ratio) * turn), chord * math.sin(0.5 * (1.0 + ratio) * turn)
    return pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y, pose[2] + ratio * turn
