"""The line through the places of a face, by weighted least squares.

y = a + b s is fitted, y along the face's normal and s across it, and the normal is turned until b = 0. Places behind
the line are left out: what no beam reaches is an outlier, the rest is another thing. Where a sensor has outliers, so is
a place ahead of the line that has no other beside it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

LEAST_PLACES = 12  # that make a line
OFF_LINE = 25.0  # squared standard deviations: of 72 new places of a scan one is off so far by chance in 10^4 scans
LONE_OFF_LINE = 36.0  # of a place with no other beside it half as far ahead: in 10^7 scans
BENT = 4.0 * OFF_LINE  # ahead of the first line, whose normal is not that of the places yet
TURNS = 2  # of the normal: the second leaves out what is behind the line without what the first left out
SAME_PLACE = 0.02  # [m] besides the noise of ranges, as far as two echoes of one thing are apart
EXACT = 1e-4  # [m] least standard deviation of a place


class Fit(NamedTuple):
    """Sums over the places of a face, seen from the first one, and the line through them."""

    weight: float  # sum of w [1/m^2]
    middle: float  # mean of s [m]
    spread: float  # sum of w (s - middle)^2
    mean: float  # of y [m]
    slope: float


@kernel
def fitted_line(window, size, normal, parameters):
    """Return (found, normal, weighted, fit) of a face whose normal is about the unit vector given.

    `weighted` (3, size) are s, y [m] and weight [1/m^2] of the face's places in `window`, 0 of those that are left out.
    Not found is a line of fewer than `LEAST_PLACES`, and one that a place is far ahead of.
    """
    weighted, (gx, gy) = np.empty((3, size)), normal
    none = False, normal, weighted, Fit(0.0, 0.0, 0.0, 0.0, 0.0)
    if size < LEAST_PLACES or not _write_places(window, normal, weighted):
        return none
    fit = _fit(weighted)
    for turn in range(TURNS):
        if not parameters.outliers and turn == 0 and _most_ahead(weighted, fit) > BENT:
            return none
        if _leave_out_behind(weighted, fit) > 0:
            fit = _fit(weighted)
        if parameters.outliers and _leave_out_outliers(window, (gx, gy), weighted, fit, parameters.least_joining) > 0:
            fit = _fit(weighted)
        if _places_left(weighted) < LEAST_PLACES:
            return none
        length = math.sqrt(1.0 + fit.slope * fit.slope)
        gx, gy = (gx + fit.slope * gy) / length, (gy - fit.slope * gx) / length
        _turn(window, (gx, gy), weighted)
        fit = _fit(weighted)
    return True, (gx, gy), weighted, fit


@kernel
def _write_places(window, normal, weighted):
    """Write s, y and weight of the places of a window to `weighted` (3, size); tell whether all are echoes."""
    for i in range(weighted.shape[1]):
        if window.point[i] < 0:
            return False
        weighted[2, i] = 1.0
    _turn(window, normal, weighted)
    return True


@kernel
def _turn(window, normal, weighted):
    """Write the places again, with another normal; those without weight stay without."""
    (gx, gy), x0, y0 = normal, window.x[0], window.y[0]
    for i in range(weighted.shape[1]):
        point = window.memory[window.point[i]]
        x, y = window.x[i] - x0, window.y[i] - y0
        weighted[0, i], weighted[1, i] = gx * y - gy * x, gx * x + gy * y
        variance = range_variance(window.std[i], point, normal) + pose_variance(point, normal)
        weighted[2, i] = 1.0 / max(variance, EXACT * EXACT) if weighted[2, i] > 0.0 else 0.0


@kernel
def range_variance(std, point, normal):
    """Return what the noise of an echo's range adds along a normal [m^2]: it is wrong along its beam, by `std` [m]."""
    return (std * (normal[0] * point["ux"] + normal[1] * point["uy"])) ** 2


@kernel
def pose_variance(point, normal):
    """Return what the pose of an echo's scan adds along a normal [m^2]; a heading is wrong across the beam."""
    turn, aside = point["turn_std"] ** 2, normal[0] * point["uy"] - normal[1] * point["ux"]
    return max(point["pose_std"] ** 2 - turn, 0.0) + turn * aside * aside


@kernel
def _off_line(weighted, fit, i):
    """Return how far place i is behind the line of all [m], negative ahead of it, and that in squared deviations."""
    off = weighted[1, i] - fit.mean - fit.slope * (weighted[0, i] - fit.middle)
    return off, off * off * weighted[2, i]


@kernel
def _most_ahead(weighted, fit):
    """Return the most squared deviations that a place is ahead of the line of all."""
    most = 0.0
    for i in range(weighted.shape[1]):
        off, deviations = _off_line(weighted, fit, i)
        most = max(most, deviations) if off < 0.0 else most
    return most


@kernel
def _leave_out_behind(weighted, fit):
    """Take the weight of places behind the line of all; return how many there are.

    Noise puts half of all places behind it: a branch would be guessed wrong.
    """
    count = 0
    for i in range(weighted.shape[1]):
        off, deviations = _off_line(weighted, fit, i)
        behind = (off > 0.0) & (deviations > OFF_LINE)
        weighted[2, i] = 0.0 if behind else weighted[2, i]
        count += behind
    return count


@kernel
def _leave_out_outliers(window, normal, weighted, fit, joining):
    """Take the weight of lone places ahead of the line of all; return how many there are.

    Neighbours nearer than `joining` [m] may be of one thing.
    """
    ahead, count = 0, 0
    for i in range(weighted.shape[1]):
        off, deviations = _off_line(weighted, fit, i)
        ahead += (off < 0.0) & (deviations > OFF_LINE)
    if ahead == 0:  # as nearly always
        return 0
    for i in range(weighted.shape[1]):
        off, deviations = _off_line(weighted, fit, i)
        if off < 0.0 and deviations > OFF_LINE and not has_support(window, normal, i, -off, joining):
            weighted[2, i], count = 0.0, count + 1
    return count


@kernel
def _places_left(weighted):
    """Return how many places have weight."""
    left = 0
    for i in range(weighted.shape[1]):
        left += weighted[2, i] > 0.0
    return left


@kernel
def has_support(window, normal, i, ahead, joining):
    """Tell whether an echo beside echo i is half as far ahead [m] or more, whether it binds or not.

    Beside it is in the same scan what is nearer than `joining` [m], and in another what is at the same place, or was
    when it confirmed the echo: that may have been replaced since.
    """
    own, (gx, gy) = window.memory[window.point[i]], normal
    if own["confirmed_within"] <= 0.5 * ahead:
        return True
    for k in range(len(window.memory)):
        point = window.memory[k]
        if point["live"] and k != window.point[i]:
            x, y, reach = point["x"] - own["x"], point["y"] - own["y"], 3.0 * (point["std"] + own["std"]) + SAME_PLACE
            reach = max(reach, joining) if point["scan"] == own["scan"] else reach
            if x * x + y * y <= reach * reach and gx * x + gy * y <= 0.5 * ahead:
                return True
    return False


@kernel
def _fit(weighted):
    """Return the `Fit` of places (3, size)."""
    weight, middle, mean, spread, slope = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(weighted.shape[1]):
        weight += weighted[2, i]
        middle += weighted[2, i] * weighted[0, i]
        mean += weighted[2, i] * weighted[1, i]
    middle, mean = middle / weight, mean / weight
    for i in range(weighted.shape[1]):
        aside = weighted[2, i] * (weighted[0, i] - middle)
        spread += aside * (weighted[0, i] - middle)
        slope += aside * weighted[1, i]
    return Fit(weight, middle, spread, mean, slope / spread if spread > 0.0 else 0.0)
