"""One scan in the world frame: the lines, the beams and the pose of the robot."""

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


LINE = np.dtype(
    [(name, np.float64) for name in ("angle", "offset", "c_aa", "c_ac", "c_cc", "low", "high")]
    + [(name, np.bool_) for name in ("free_low", "free_high")]
    + [(name, np.int64) for name in ("role", "track")],
    align=True,
)
"""One line of a `View`, and what becomes of it: its role (see association.py) and its track, -1 for none yet."""


class Moment(NamedTuple):
    """The clock and the pose of a `View`, without its arrays."""

    x: float
    y: float
    shift_x: float
    shift_y: float
    time: float
    elapsed: float
    position_var: float
    heading_var: float


@kernel
def moment_of(view):  # pragma: no cover - compiled
    """Return the Moment of a View."""
    return Moment(
        view.x,
        view.y,
        view.shift_x,
        view.shift_y,
        view.time,
        view.elapsed,
        view.position_var,
        view.heading_var,
    )


@kernel
def lines_of(view):  # pragma: no cover - compiled
    """Return the lines (L,) of a View as records: one pointer for each, where views of arrays would be counted."""
    lines = np.empty(len(view.angle), LINE)
    for i in range(len(lines)):
        line = lines[i]
        line["angle"], line["offset"] = view.angle[i], view.offset[i]
        line["c_aa"], line["c_ac"] = view.covariance[i, 0, 0], view.covariance[i, 0, 1]
        line["c_cc"] = view.covariance[i, 1, 1]
        line["low"], line["high"] = view.low[i], view.high[i]
        line["free_low"], line["free_high"] = view.free_low[i], view.free_high[i]
        line["role"], line["track"] = 0, -1
    return lines


@kernel
def turn_into(beams, directions, heading):  # pragma: no cover - compiled
    """Write the `directions` (B, 2) of a robot that heads [rad] to `beams`, in the world."""
    cos, sin = math.cos(heading), math.sin(heading)
    for k in range(len(directions)):
        beams[k, 0] = cos * directions[k, 0] - sin * directions[k, 1]
        beams[k, 1] = sin * directions[k, 0] + cos * directions[k, 1]


@kernel
def view(lines, count, ranges, beams, pose):  # pragma: no cover - compiled
    """Return what a scan showed: the first `count` of `lines` (a LineBuffer), turned from the body into the world.

    The noise of the ScanPose `pose` is added to every line: with the robot's own position as the anchor, an error of
    the heading turns the line and an error of the position shifts it, whatever the distance.
    """
    for line in range(count):
        lines.angle[line] += pose.heading
        lines.covariance[line, 0, 0] += pose.heading_var
        lines.covariance[line, 1, 1] += pose.position_var
    return View(
        lines.angle[:count],
        lines.offset[:count],
        lines.covariance[:count],
        lines.low[:count],
        lines.high[:count],
        lines.free_low[:count],
        lines.free_high[:count],
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
