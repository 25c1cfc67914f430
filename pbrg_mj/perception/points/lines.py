"""Straight faces at rest: where they are, and which places and echoes are theirs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.fitted_line import EXACT, LONE_OFF_LINE, OFF_LINE

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


FIELDS = len(Line._fields)


@kernel
def no_lines(count):
    """Return room for so many lines, (count, FIELDS), which are none."""
    return np.zeros((count, FIELDS))


@kernel
def write_line(line, lines, k):
    """Write a `Line` to row k of `lines` (K, FIELDS), which are none where they are 0."""
    row = lines[k]
    row[:] = 0.0
    if line.found:
        row[0], row[1], row[2], row[3], row[4] = 1.0, line.gx, line.gy, line.offset, line.std
        row[5], row[6], row[7] = line.low, line.high, line.speed


@kernel
def line_at(lines, k):
    """Return the `Line` in row k of `lines` (K, FIELDS)."""
    row = lines[k]
    return Line(row[0] > 0.0, row[1], row[2], row[3], row[4], row[5], row[6], row[7])


@kernel
def extension_limits(places, chosen, line):
    """Return how far a `Line` may go on beyond its ends: from where to where no beam passed it [m].

    A beam passed it whose echo is behind it, as one that is left out of its fit. Where it did, its direction tells. All
    `places` are looked at, those that are kept off already, too. Nobody asks where none of the places chosen (size,) is
    on it beyond the ends.
    """
    first, last, asked = -math.inf, math.inf, False
    if line.found:
        for i in chosen:
            on, inside = _place_fits(places, i, line)
            asked |= on & (not inside)
    if not asked:
        return first, last
    behind, size = np.empty(len(places.x), np.int64), 0
    for i in range(len(places.x)):  # without a branch, which would be guessed wrong
        behind[size] = i
        size += line.gx * places.x[i] + line.gy * places.y[i] > line.offset
    for i in behind[:size]:
        if places.point[i] >= 0:
            crossing = _crossing(places.memory[places.point[i]], line)
            if crossing > line.high:
                last = min(last, crossing)
            elif crossing < line.low:
                first = max(first, crossing)
    return first, last


@kernel
def _crossing(point, line):
    """Return where along a `Line` the beam passed it whose echo a point behind it is [m]; nan if none surely did."""
    off = line.gx * point["x"] + line.gy * point["y"] - line.offset
    ahead = line.gx * point["ux"] + line.gy * point["uy"]
    variance = (ahead * point["std"]) ** 2 + point["pose_std"] ** 2 + line.std**2
    if not (ahead > 0.0 and off * off > OFF_LINE * variance and point["binds"]):
        return math.nan
    aside = line.gx * point["uy"] - line.gy * point["ux"]
    return line.gx * point["y"] - line.gy * point["x"] - off * aside / ahead


@kernel
def is_on_line(places, i, line, limits):
    """Tell whether place i is one of those that a `Line` goes through, or goes on to.

    `limits` (2,) [m] are its `extension_limits`, beyond which it does not. A corner beside one of the former lies on
    the line, as the places around it tell. Of the latter the echo itself has to tell where a corner beside it may be.
    """
    if not line.found or places.point[i] < 0:
        return False
    point = places.memory[places.point[i]]
    if not point["binds"]:  # no more: an outlier
        return True
    on, inside = _place_fits(places, i, line)
    goes_on = limits[0] <= line.gx * places.y[i] - line.gy * places.x[i] <= limits[1]
    return on and (inside or (goes_on and point["slack"] <= ON_LINE))


@kernel
def echoes_on_lines(echoes, lines):
    """Return which echoes (beams,) are of a straight face at rest: of one of the `lines` (K, FIELDS)."""
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
def _place_fits(places, i, line):
    """Tell whether place i is an echo that may be on a `Line`, and whether it is between its ends."""
    if places.point[i] < 0:
        return False, False
    variance = places.std[i] ** 2 + places.memory[places.point[i]]["pose_std"] ** 2
    return _fits(line, places.x[i], places.y[i], variance)


@kernel
def _fits(line, x, y, variance):
    """Tell whether a place of that variance [m^2] may be on a `Line`, and whether it is between its ends."""
    along, off = line.gx * y - line.gy * x, line.gx * x + line.gy * y - line.offset
    return off * off <= LONE_OFF_LINE * (variance + line.std**2 + EXACT**2), line.low <= along <= line.high
