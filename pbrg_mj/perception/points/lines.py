"""Straight faces at rest: where they are, and which places and echoes are theirs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.fitted_line import EXACT, LONE_OFF_LINE

ON_LINE = 0.01  # [m] that a corner may be off the line of its face


class Line(NamedTuple):
    """A straight face; only `found` tells anything where it is none."""

    found: bool
    gx: float  # normal, away from the robot
    gy: float
    offset: float  # along the normal [m]
    std: float  # of the offset beside the path [m]
    low: float  # where it begins and ends, along (-gy, gx) [m]
    high: float
    speed: float  # at which it surely comes nearer, and by a deviation more; 0 for one that may rest [m/s]


@kernel
def write_line(line, lines, k):
    """Write a `Line` to row k of `lines` (K, 8), which are none where they are 0."""
    for column in range(8):
        lines[k, column] = 0.0
    if line.found:
        lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3] = 1.0, line.gx, line.gy, line.offset
        lines[k, 4], lines[k, 5], lines[k, 6], lines[k, 7] = line.std, line.low, line.high, line.speed


@kernel
def line_at(lines, k):
    """Return the `Line` in row k of `lines` (K, 8)."""
    row = lines[k]
    return Line(row[0] > 0.0, row[1], row[2], row[3], row[4], row[5], row[6], row[7])


@kernel
def is_on_line(places, i, line):
    """Tell whether place i is one of those that a `Line` goes through, or goes on to.

    A corner beside one of the former lies on the line, as the places around it tell. Of the latter the echo itself has
    to tell where a corner beside it may be.
    """
    if not line.found or places.point[i] < 0:
        return False
    point = places.memory[places.point[i]]
    if not point["binds"]:  # no more: an outlier
        return True
    on, inside = _fits(line, places.x[i], places.y[i], places.std[i] ** 2 + point["pose_std"] ** 2)
    return on and (inside or point["slack"] <= ON_LINE)


@kernel
def echoes_on_lines(echoes, lines):
    """Return which echoes (beams,) are of a straight face at rest: of one of the `lines` (K, 8) of `write_line`."""
    found = np.zeros(len(echoes.x), np.bool_)
    for i in range(len(lines)):
        line = line_at(lines, i)
        if line.found:
            for k in range(len(found)):
                if echoes.external[k]:
                    on, inside = _fits(line, echoes.x[k], echoes.y[k], echoes.variance[k] + echoes.pose_std[k] ** 2)
                    found[k] = found[k] or (on and inside)
    return found


@kernel
def _fits(line, x, y, variance):
    """Tell whether a place of that variance [m^2] may be on a `Line`, and whether it is between its ends."""
    along, off = line.gx * y - line.gy * x, line.gx * x + line.gy * y - line.offset
    return off * off <= LONE_OFF_LINE * (variance + line.std**2 + EXACT**2), line.low <= along <= line.high
