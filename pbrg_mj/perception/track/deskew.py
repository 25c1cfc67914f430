"""A scan that takes time, as if taken at once at its end, and where all robots were when each beam was taken.

Poses are those of the camera, and that at the scan's end. The echo of a beam is moved by how far the robot has come
since that beam, by the same poses. A team-mate is looked for where it was then.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from pbrg_mj.perception.track.pose_history import PoseHistory, scanned
from pbrg_mj.perception.track.world_frame import FRESH, PoseModel
from pbrg_mj.sensing.readings import Readings

ONE = np.ones((1, 1))


class Scanner(Protocol):
    """How a scan is taken, as the parameters of an estimator tell it."""

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors (beams, 2) of the beams in the body frame, in the order in which they are taken."""
        ...

    @property
    def scan_time(self) -> float:
        """From the first beam of a scan to its end [s]; 0: all at once."""
        ...

    @property
    def range_max(self) -> float:
        """Range limit [m]."""
        ...

    @property
    def pose(self) -> PoseModel:
        """Clock of the scans and of the camera."""
        ...


class DeskewedScans(NamedTuple):
    """Scans in the body frames that robots had at the end of the scan."""

    ranges: np.ndarray  # (R, beams) [m]
    directions: np.ndarray  # (R, beams, 2) unit vectors, or (1, beams, 2): the same for all
    bodies: np.ndarray  # (beams, n, 2) places of robots when a beam was taken [m], or (1, n, 2): for all beams
    shares: np.ndarray  # (beams, J) of the poses between which a beam was taken, or (1, 1): all are of one pose


def deskewed(
    readings: Readings, history: PoseHistory, end: np.ndarray, robots: np.ndarray, scanner: Scanner
) -> DeskewedScans:
    """Return the readings' scans, of `robots` (R,), as if taken at their end, when robots were at `end` (n, 3)."""
    if not scanner.scan_time > 0.0 or readings.pose_frame < 0:
        return DeskewedScans(readings.ranges, scanner.directions[None], end[None, :, :2].copy(), ONE)
    taken, count = scanned(readings.scan_frame, scanner.pose), readings.ranges.shape[1]
    early = scanner.scan_time * (1.0 - np.arange(1, count + 1) / count)
    step = scanner.pose.step  # of physics, at which beams are taken as soon as they are due
    history, times = _until(taken, end, history), np.minimum(np.ceil((taken - early) / step - FRESH) * step, taken)
    poses = poses_at(history, times)
    own = poses[:, robots]  # (beams, R, 3)
    turn = own[:, :, 2] - own[-1, :, 2]
    cos, sin, dx, dy = np.cos(turn), np.sin(turn), scanner.directions[:, :1], scanner.directions[:, 1:]
    reach = np.where(np.isnan(readings.ranges), scanner.range_max, readings.ranges).T
    came = _turned_back(own[:, :, :2] - own[-1, :, :2], own[-1, :, 2])
    ends = came + reach[:, :, None] * np.stack([cos * dx - sin * dy, sin * dx + cos * dy], axis=-1)
    lengths = np.linalg.norm(ends, axis=-1)
    directions = np.ascontiguousarray(np.swapaxes(ends / lengths[:, :, None], 0, 1))
    ranges = np.where(np.isnan(readings.ranges), np.nan, lengths.T)
    shares = ONE if readings.pose_filter is not None else _shares(history, times)  # a filter's errors are alike
    return DeskewedScans(ranges, directions, np.ascontiguousarray(poses[:, :, :2]), shares)


def _until(time: float, poses: np.ndarray, history: PoseHistory) -> PoseHistory:
    """Return a history that ends with the `poses` (n, 3) of a later time [s]; itself where it goes on until then."""
    if time <= history.time[-1]:
        return history
    return PoseHistory(np.append(history.time, time), np.concatenate([history.poses, poses[None]]))


def poses_at(history: PoseHistory, times: np.ndarray) -> np.ndarray:
    """Return all robots' poses (k, n, 3) at `times` (k,) [s], on the way from one pose of the history to the next.

    Before the first they were where they are then, after the last where they are then.
    """
    poses, (before, share) = history.poses, _between(history, times)
    step = poses[before + 1] - poses[before]
    step[:, :, 2] = np.remainder(step[:, :, 2] + math.pi, 2.0 * math.pi) - math.pi
    return poses[before] + share[:, None, None] * step


def _between(history: PoseHistory, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the pose before each of `times` (k,) [s], and how much of the way to the next is over."""
    time = history.time
    before = np.clip(np.searchsorted(time, times), 1, len(time) - 1) - 1
    return before, np.clip((times - time[before]) / (time[before + 1] - time[before]), 0.0, 1.0)


def _shares(history: PoseHistory, times: np.ndarray) -> np.ndarray:
    """Return the shares (k, J) of the poses of the history in those at `times` (k,) [s], without poses of no share."""
    before, share = _between(history, times)
    shares, beams = np.zeros((len(times), len(history.time))), np.arange(len(times))
    shares[beams, before], shares[beams, before + 1] = 1.0 - share, share
    return np.ascontiguousarray(shares[:, before.min() : before.max() + 2])


def _turned_back(vectors: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return vectors (k, R, 2) in the frames of headings (R,)."""
    cos, sin, (x, y) = np.cos(heading), np.sin(heading), np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)
