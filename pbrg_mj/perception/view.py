"""One robot's scan as compiled code takes it: the lines, the beams and where the robot believes it stood."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel


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


@kernel
def view(lines, ranges, directions, pose):
    """Return what a scan showed: `lines` are a LineBuffer's, in the body frame, and `pose` a ScanPose.

    The pose's noise is added to every line: with the robot's own position as the anchor, an error of the heading
    turns the line and an error of the position shifts it, whatever the distance.
    """
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    beams = np.empty_like(directions)
    beams[:, 0] = cos * directions[:, 0] - sin * directions[:, 1]
    beams[:, 1] = sin * directions[:, 0] + cos * directions[:, 1]
    covariance = lines.covariance.copy()
    covariance[:, 0, 0] += pose.heading_var
    covariance[:, 1, 1] += pose.position_var
    return View(
        lines.angle + pose.heading,
        lines.offset,
        covariance,
        lines.low,
        lines.high,
        lines.free_low,
        lines.free_high,
        ranges,
        beams,
        pose.x,
        pose.y,
        pose.shift_x,
        pose.shift_y,
        pose.time,
        pose.elapsed,
        pose.position_var,
        pose.heading_var,
    )
