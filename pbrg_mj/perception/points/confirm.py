"""A lone echo waits until echoes of earlier scans at its place confirm that it is no outlier."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

APART = 0.02  # [m] besides noise that echoes at one place may be apart
ABOVE = 1.0 + 1e-9  # by which a bound is above what it bounds, however both are rounded


class EarlierEchoes(NamedTuple):
    """The points of earlier scans; functions look at the first `used` entries of each array."""

    used: int
    recent: int  # number of the oldest of the recent scans
    x: np.ndarray  # (M,) [m]
    y: np.ndarray  # (M,) [m]
    number: np.ndarray  # (M,) of the point in the memory
    near: np.ndarray  # (M,) room for whether each is near an echo
    matches: np.ndarray  # (M,) room for numbers of points
    std: float  # the largest standard deviation of a range, of all points [m]
    pose_std: float  # the largest of what poses add [m]


@kernel
def earlier_echoes(points, scan, recent, confirming):
    """Return the `EarlierEchoes` among the points, of the `confirming` scans before this one.

    The last `recent` of them are the recent ones.
    """
    size, used, std, pose_std = len(points), 0, 0.0, 0.0
    x, y, number = np.empty(size), np.empty(size), np.empty(size, np.int64)
    for i in range(size):  # without a branch: the processor would guess wrong whether a point counts
        point = points[i]
        x[used], y[used], number[used] = point["x"], point["y"], i
        std, pose_std, age = max(std, point["std"]), max(pose_std, point["pose_std"]), scan - point["scan"]
        used += point["live"] & (age > 0) & (age <= confirming)
    near, matches = np.empty(size, np.bool_), np.empty(size, np.int64)
    return EarlierEchoes(used, scan - recent, x, y, number, near, matches, std, pose_std)


@kernel
def confirm_echo(points, earlier, asked, pose, parameters):
    """Confirm an echo if as many recent ones as are needed lie at its place, or one more of all earlier ones.

    Within `parameters.confirmation_range` so many of all earlier ones are enough. Then these bind, too. Return how
    far the nearest of them is [m], infinite where the echo is not confirmed.

    `asked` are the echo (x, y, std, pose_std) [m], the last two its range's standard deviation and its pose's, and how
    many are needed. The same place is within three standard deviations, along the beam of the ranges and across it of
    the pose, and a gap between beams to either side.
    """
    echo, needed = asked
    ux, uy = echo[0] - pose.x, echo[1] - pose.y
    distance = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / distance, uy / distance
    enough = needed if distance < parameters.confirmation_range else needed + 1
    found, recent, beam = 0, 0, (ux, uy, parameters.gap * distance)
    poses = 3.0 * (echo[3] + earlier.pose_std) + APART
    most, ray = ((3.0 * (echo[2] + earlier.std) + poses) * ABOVE, (beam[2] + poses) * ABOVE), (echo[0], echo[1], ux, uy)
    for i in range(_write_near(earlier, ray, most)):
        number = earlier.matches[i]
        if _at_one_place(points[number], echo, beam):
            earlier.matches[found] = number
            found, recent = found + 1, recent + (points[number]["scan"] >= earlier.recent)
    if recent < needed and found < enough:
        return math.inf
    nearest = math.inf
    for j in range(found):
        point = points[earlier.matches[j]]
        away = math.sqrt((point["x"] - echo[0]) ** 2 + (point["y"] - echo[1]) ** 2)
        point["binds"], point["confirmed_within"] = True, min(point["confirmed_within"], away)
        nearest = min(nearest, away)
    return nearest


@kernel
def _write_near(earlier, ray, most):
    """Write the numbers of the points that are as near to the end of a ray as `most` (along it, across it) [m].

    `ray` is that end and a unit vector, (x0, y0, ux, uy). They become the first of `earlier.matches`; return how many.
    In two passes without a branch: the first looks at several points an instruction.
    """
    (x0, y0, ux, uy), (along, across), count = ray, most, 0
    for j in range(earlier.used):
        dx, dy = earlier.x[j] - x0, earlier.y[j] - y0
        earlier.near[j] = (abs(dx * ux + dy * uy) <= along) & (abs(dx * uy - dy * ux) <= across)
    for j in range(earlier.used):
        earlier.matches[count] = earlier.number[j]
        count += earlier.near[j]
    return count


@kernel
def _at_one_place(other, echo, beam):
    """Tell whether a POINT `other` lies at the place of an echo (x, y, std, pose_std) [m].

    `beam` is the unit vector along it, ux, uy, and beside, the gap between beams there [m].
    """
    (x, y, std, pose_std), (ux, uy, beside) = echo, beam
    dx, dy = other["x"] - x, other["y"] - y
    across = abs(dx * uy - dy * ux)
    if across > (beside + 3.0 * (pose_std + other["pose_std"]) + APART) * ABOVE:
        return False  # most are: no root is taken for them
    poses = 3.0 * math.sqrt(pose_std**2 + other["pose_std"] ** 2) + APART
    along = 3.0 * math.sqrt(std**2 + other["std"] ** 2) + poses
    return abs(dx * ux + dy * uy) <= along and across <= beside + poses
