"""One robot's scan as compiled code takes it: the lines, the beams and where the robot believes it stood."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.perception.frames import ScanPose
from pbrg_mj.perception.scan_lines import Lines


class View(NamedTuple):
    """What one scan showed to a robot, and the clock."""

    angle: np.ndarray  # (L,) of the lines' normals in the world [rad]
    offset: np.ndarray  # (L,) of the lines from the robot [m]
    covariance: np.ndarray  # (L, 2, 2) of (angle, offset): range noise and pose noise
    low: np.ndarray  # (L,) extent along t, from the robot's foot [m]
    high: np.ndarray  # (L,) [m]
    free_low: np.ndarray  # (L,) bool
    free_high: np.ndarray  # (L,) bool
    ranges: np.ndarray  # (beams,) [m]
    beams: np.ndarray  # (beams, 2) directions in the world
    x: float  # of the robot [m]
    y: float  # [m]
    shift_x: float  # of the robot since its last scan [m]
    shift_y: float  # [m]
    time: float  # [s]
    elapsed: float  # since the last scan [s]
    position_var: float  # of the robot's position, along each axis [m^2]
    heading_var: float  # of its heading [rad^2]


def view(lines: Lines, ranges: np.ndarray, directions: np.ndarray, pose: ScanPose) -> View:
    """Return what a scan showed.

    The pose's noise is added to every line: with the robot's own position as the anchor, an error of the heading
    turns the line and an error of the position shifts it, whatever the distance.
    """
    x, y, heading = pose.pose
    cos, sin = np.cos(heading), np.sin(heading)
    beams = directions @ np.array([[cos, sin], [-sin, cos]])
    covariance = lines.covariance + np.diag([pose.heading_var, pose.position_var])
    return View(
        lines.angle + heading, lines.offset, covariance, lines.low, lines.high, lines.free_low, lines.free_high,
        ranges, beams, x, y, pose.shift[0], pose.shift[1], pose.time, pose.elapsed,
        pose.position_var, pose.heading_var,
    )  # fmt: skip
