"""A lone echo waits until echoes of recent scans at its place confirm that it is no outlier."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

ABOVE = 1.0 + 1e-9  # by which a bound is above what it bounds, however both are rounded


class RecentEchoes(NamedTuple):
    """The points of recent scans; functions look at the first `used` entries of each array."""

    scan: int  # before which they were seen
    used: int
    x: np.ndarray  # (M,) [m]
    y: np.ndarray  # (M,) [m]
    number: np.ndarray  # (M,) of the point in the memory
    near: np.ndarray  # (M,) room for whether each is near an echo
    matches: np.ndarray  # (M,) room for numbers of points
    std: float  # the largest standard deviation of a range, of all points [m]
    pose_std: float  # the largest of what poses add [m]


@kernel
def recent_echoes(points, scan, recent):
    """Return the `RecentEchoes` among the points, of the `recent` scans before this one."""
    size, used, std, pose_std = len(points), 0, 0.0, 0.0
    x, y, number = np.empty(size), np.empty(size), np.empty(size, np.int64)
    for i in range(size):  # without a branch: the processor would guess wrong whether a point counts
        point = points[i]
        x[used], y[used], number[used] = point["x"], point["y"], i
        std, pose_std, age = max(std, point["std"]), max(pose_std, point["pose_std"]), scan - point["scan"]
        used += point["live"] & (age > 0) & (age <= recent)
    return RecentEchoes(scan, used, x, y, number, np.empty(size, np.bool_), np.empty(size, np.int64), std, pose_std)


@kernel
def confirm_echo(points, recents, asked, pose, parameters):
    """Confirm an echo if as many recent ones as are needed lie at its place: then these bind, too; tell whether.

    `asked` are the echo (x, y, std, pose_std) [m], the last two its range's standard deviation and its pose's, and how
    many are needed. The same place is within three standard deviations, along the beam of the ranges and across it of
    the pose, and a gap between beams to either side.
    """
    echo, needed = asked
    ux, uy = echo[0] - pose.x, echo[1] - pose.y
    distance = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / distance, uy / distance
    found, beam = 0, (ux, uy, parameters.gap * distance)
    poses = 3.0 * (echo[3] + recents.pose_std) + 0.02
    most, ray = ((3.0 * (echo[2] + recents.std) + poses) * ABOVE, (beam[2] + poses) * ABOVE), (echo[0], echo[1], ux, uy)
    for i in range(_write_near(recents, ray, most)):
        number = recents.matches[i]
        point = points[number]
        if point["scan"] < recents.scan and _at_one_place(point, echo, beam):  # else its slot was taken since
            recents.matches[found] = number
            found += 1
    if found < needed:
        return False
    for j in range(found):
        points[recents.matches[j]]["binds"] = True
    return True


@kernel
def _write_near(recents, ray, most):
    """Write the numbers of the points that are as near to the end of a ray as `most` (along it, across it) [m].

    `ray` is that end and a unit vector, (x0, y0, ux, uy). They become the first of `recents.matches`; return how many.
    In two passes without a branch: the first looks at several points an instruction.
    """
    (x0, y0, ux, uy), (along, across), count = ray, most, 0
    for j in range(recents.used):
        dx, dy = recents.x[j] - x0, recents.y[j] - y0
        recents.near[j] = (abs(dx * ux + dy * uy) <= along) & (abs(dx * uy - dy * ux) <= across)
    for j in range(recents.used):
        recents.matches[count] = recents.number[j]
        count += recents.near[j]
    return count


@kernel
def _at_one_place(other, echo, beam):
    """Tell whether a POINT `other` lies at the place of an echo (x, y, std, pose_std) [m].

    `beam` is the unit vector along it, ux, uy, and beside, the gap between beams there [m].
    """
    (x, y, std, pose_std), (ux, uy, beside) = echo, beam
    dx, dy = other["x"] - x, other["y"] - y
    across = abs(dx * uy - dy * ux)
    if across > (beside + 3.0 * (pose_std + other["pose_std"]) + 0.02) * ABOVE:
        return False  # most are: no root is taken for them
    poses = 3.0 * math.sqrt(pose_std**2 + other["pose_std"] ** 2) + 0.02
    along = 3.0 * math.sqrt(std**2 + other["std"] ** 2) + poses
    return abs(dx * ux + dy * uy) <= along and across <= beside + poses
