"""A scan that takes time, as if taken at once at its end, and where all robots were when each beam was taken.

Poses are those of the camera, carried on from its last frame to the scan's end at the speed over one scan's time. The
echo of a beam is moved by how far the robot has come since that beam, by the same poses. A team-mate is looked for
where it was then.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.perception.points.parameters import PointParameters
from pbrg_mj.sensing.readings import Readings


class PoseHistory(NamedTuple):
    """Poses that the camera told, oldest first; none where a scan takes no time. Never written to."""

    time: np.ndarray  # (H,) when robots were there [s]; -inf: nothing yet
    poses: np.ndarray  # (H, n, 3) x, y [m], heading [rad]


class DeskewedScans(NamedTuple):
    """Scans in the body frames that robots had at the end of the scan."""

    ranges: np.ndarray  # (R, beams) [m]
    directions: np.ndarray  # (R, beams, 2) unit vectors, or (1, beams, 2): the same for all
    bodies: np.ndarray  # (beams, n, 2) places of robots when a beam was taken [m], or (1, n, 2): for all beams


def no_poses(robots: int, frames: int) -> PoseHistory:
    """Return an empty history of so many frames."""
    return PoseHistory(np.full(frames, -math.inf), np.full((frames, robots, 3), np.nan))


def with_poses(history: PoseHistory, readings: Readings, time: float, parameters: PointParameters) -> PoseHistory:
    """Return the history with the readings' poses at `time` [s]; the same one if it has them already."""
    told = min(readings.pose_frame * parameters.pose.frame_period + parameters.pose.dated_late, time)
    if not len(history.time) or readings.pose_frame < 0 or told <= history.time[-1]:
        return history
    return PoseHistory(np.append(history.time[1:], told), np.concatenate([history.poses[1:], readings.body_pose[None]]))


def deskewed(
    readings: Readings, history: PoseHistory, robots: np.ndarray, parameters: PointParameters
) -> DeskewedScans:
    """Return the readings' scans, of `robots` (R,), as if taken at their end."""
    known = history.time > -math.inf
    if not known.any():
        return DeskewedScans(readings.ranges, parameters.directions[None], readings.body_pose[None, :, :2].copy())
    end, count = readings.scan_frame * parameters.pose.scan_period, readings.ranges.shape[1]
    early = parameters.scan_time * (1.0 - np.arange(1, count + 1) / count)
    poses = poses_at(PoseHistory(history.time[known], history.poses[known]), end - early, parameters.scan_time)
    own = poses[:, robots]  # (beams, R, 3)
    turn = own[:, :, 2] - own[-1, :, 2]
    cos, sin, dx, dy = np.cos(turn), np.sin(turn), parameters.directions[:, :1], parameters.directions[:, 1:]
    reach = np.where(np.isnan(readings.ranges), parameters.range_max, readings.ranges).T
    came = _turned_back(own[:, :, :2] - own[-1, :, :2], own[-1, :, 2])
    ends = came + reach[:, :, None] * np.stack([cos * dx - sin * dy, sin * dx + cos * dy], axis=-1)
    lengths = np.linalg.norm(ends, axis=-1)
    directions = np.ascontiguousarray(np.swapaxes(ends / lengths[:, :, None], 0, 1))
    ranges = np.where(np.isnan(readings.ranges), np.nan, lengths.T)
    return DeskewedScans(ranges, directions, np.ascontiguousarray(poses[:, :, :2]))


def poses_at(history: PoseHistory, times: np.ndarray, span: float) -> np.ndarray:
    """Return all robots' poses (k, n, 3) at `times` (k,) [s]: between frames along the way from one to the next.

    Beyond the last frame robots go on at their speed over the last `span` [s] of the history; before the first they
    were where they are then.
    """
    time, poses = history
    if len(time) == 1:
        return np.repeat(poses, len(times), axis=0)
    after = np.clip(np.searchsorted(time, times), 1, len(time) - 1)
    before = after - 1
    late = times > time[-1]
    before[late] = max(int(np.searchsorted(time, time[-1] - span, side="right")) - 1, 0)
    before = np.minimum(before, after - 1)
    share = np.maximum((times - time[before]) / (time[after] - time[before]), 0.0)[:, None]
    step = poses[after] - poses[before]
    step[:, :, 2] = np.remainder(step[:, :, 2] + math.pi, 2.0 * math.pi) - math.pi
    return poses[before] + share[:, :, None] * step


def _turned_back(vectors: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return vectors (k, R, 2) in the frames of headings (R,)."""
    cos, sin, (x, y) = np.cos(heading), np.sin(heading), np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)
