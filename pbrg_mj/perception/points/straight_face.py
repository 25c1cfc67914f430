"""The line of a straight face at rest: its places together tell better where it is than the nearest of them does.

Noise of ranges is independent from echo to echo. The errors of a pose are the same for all echoes of a scan, and
independent from scan to scan. A face may be a little bent, c q(s) with q the quadratic that is orthogonal to 1 and s
(Forsythe, J. SIAM 5(2), 1957): the line goes through where the bent face is nearest, or through a part of it that is
nearer still.

No line is what is off it by more than `OFF_LINE` deviations, one place or the mean of those in a part of it, and by
more than `LONE_OFF_LINE` a place ahead that has no other beside it: things that lie against a wall are kept off echo by
echo. Nor is what may come nearer at `rest_speed`, as the means of the scans tell: places of several scans are where
it was, not where it is.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face import clearance_along
from pbrg_mj.perception.points.fitted_line import LONE_OFF_LINE, OFF_LINE, fitted_line, has_support, pose_variance
from pbrg_mj.perception.points.lines import Line
from pbrg_mj.perception.points.motion import MOVES

BESIDE = 0.01  # [m] by which the path keeps farther from a face than from its line where it passes by the end
PARTS = 16  # of a face's length
SCANS = 16  # that are told apart, by their number modulo this


@kernel
def straight_face(face, about, parameters):
    """Return the `Line` of a face (window, size, path) with `about` (2,) the normal of the widest gap to the path.

    It is none where the path passes by the end of the face: the line goes on there, the face does not. Where a sensor
    has outliers, an echo ahead of the line binds no more until a second one confirms it.
    """
    window, size, path = face
    nothing = Line(False, about[0], about[1], 0.0, 0.0, 0.0, 0.0, 0.0)
    if parameters.half_cone > 0.0:  # which do not tell where in their view a thing is
        return nothing
    found, normal, weighted, fit = fitted_line(window, size, about, parameters)
    if not found or _passes_beside(face, normal, about, fit):
        return nothing
    low, high = _ends(weighted)
    if high - low < parameters.straight_length:
        return nothing
    pose_var = _pose_variance(window, normal, weighted, fit)
    approach, speed = _approach(window, weighted, fit, pose_var, parameters.rest_speed)
    if approach < 0.0:
        return nothing
    shares = _shares(window, weighted, (low, high))
    parts = _parts(weighted, fit, (low, high), (shares, pose_var))
    if not _is_straight((window, normal, weighted), fit, parts, parameters):
        return nothing
    for i in range(size):
        if weighted[2, i] == 0.0 and weighted[1, i] < fit.mean:
            window.memory[window.point[i]]["binds"] = False
    pose_var *= ((shares.sum(axis=0) / fit.weight) ** 2).sum()
    (bulge, bulge_std), (gx, gy), x0, y0 = _bulge(weighted, fit, (low, high)), normal, window.x[0], window.y[0]
    variance = _variance_beside(path, (normal, x0, y0), fit, (low, high)) + pose_var + bulge_std**2
    ahead = max(bulge, _surely_ahead(parts))
    offset, along = gx * x0 + gy * y0 + fit.mean - ahead - approach, gx * y0 - gy * x0
    return Line(True, gx, gy, offset, math.sqrt(variance), along + low, along + high, speed)


@kernel
def _ends(weighted):
    """Return where a face's places begin and end along it [m]."""
    low, high = math.inf, -math.inf
    for i in range(weighted.shape[1]):
        if weighted[2, i] > 0.0:
            low, high = min(low, weighted[0, i]), max(high, weighted[0, i])
    return low, high


@kernel
def _passes_beside(face, normal, about, fit):
    """Tell whether the path keeps farther from a face's places along `about` than from the line along its normal."""
    window, _, path = face
    (gx, gy), x0, y0 = normal, window.x[0], window.y[0]
    ahead = gx * x0 + gy * y0 + fit.mean - max(gx * path[0] + gy * path[1], gx * path[2] + gy * path[3])
    return ahead < clearance_along(face, about) - BESIDE


@kernel
def _variance_beside(path, frame, fit, ends):
    """Return what ranges add to the variance of a line beside the path, or at its end nearest to the path [m^2].

    `frame` are the normal and the place x0, y0 [m] where s = 0.
    """
    ((gx, gy), x0, y0), variance = frame, 0.0
    for end in (0, 2):
        s = gx * (path[end + 1] - y0) - gy * (path[end] - x0)
        aside = min(max(s, ends[0]), ends[1]) - fit.middle
        variance = max(variance, 1.0 / fit.weight + aside * aside / fit.spread)
    return variance


@kernel
def _pose_variance(window, normal, weighted, fit):
    """Return the variance along the normal that its pose adds to a place, the mean of all places [m^2]."""
    variance = 0.0
    for i in range(weighted.shape[1]):
        variance += weighted[2, i] / fit.weight * pose_variance(window.memory[window.point[i]], normal)
    return variance


@kernel
def _shares(window, weighted, ends):
    """Return the weight of each part of a face that is of each scan, (PARTS, SCANS)."""
    shares, ratio = np.zeros((PARTS, SCANS)), PARTS / (ends[1] - ends[0])
    for i in range(weighted.shape[1]):
        if weighted[2, i] > 0.0:
            scan = window.memory[window.point[i]]["scan"] % SCANS
            shares[min(int((weighted[0, i] - ends[0]) * ratio), PARTS - 1), scan] += weighted[2, i]
    return shares


@kernel
def _approach(window, weighted, fit, pose_var, rest_speed):
    """Return how much nearer a face surely is now than in the mean of its scans [m], and the speed of a `Line`.

    -1 and 0 if it may come faster than `rest_speed` [m/s].
    """
    newest = 0
    for i in range(weighted.shape[1]):
        if weighted[2, i] > 0.0:
            newest = max(newest, window.memory[window.point[i]]["scan"])
    weight, off, time, now = np.zeros(SCANS), np.zeros(SCANS), np.zeros(SCANS), 0.0
    for i in range(weighted.shape[1]):
        point = window.memory[window.point[i]]
        if newest - point["scan"] < SCANS and weighted[2, i] > 0.0:
            k = point["scan"] % SCANS
            weight[k], time[k] = weight[k] + weighted[2, i], point["time"]
            off[k] += weighted[2, i] * (weighted[1, i] - fit.mean)
            now = max(now, point["time"])
    total, middle, spread, drift = 0.0, 0.0, 0.0, 0.0
    for k in range(SCANS):
        if weight[k] > 0.0:
            off[k], weight[k] = off[k] / weight[k], weight[k] / (1.0 + weight[k] * pose_var)
            total, middle = total + weight[k], middle + weight[k] * (now - time[k])
    middle /= total
    for k in range(SCANS):
        if weight[k] > 0.0:
            age = now - time[k] - middle
            spread, drift = spread + weight[k] * age * age, drift + weight[k] * age * off[k]
    if not spread > 0.0:
        return -1.0, 0.0
    speed, std = drift / spread, math.sqrt(1.0 / spread)  # towards the robot
    if abs(speed) + 3.0 * std > rest_speed:
        return -1.0, 0.0
    if speed > 0.0 and speed * speed > MOVES * std * std:
        return speed * middle, speed + std
    return max(speed - std, 0.0) * middle, 0.0


@kernel
def _parts(weighted, fit, ends, noise):
    """Return the mean of y off the line in each part of a face (PARTS,) [m], and its variance (PARTS,) [m^2].

    `noise` are the shares (PARTS, SCANS) and pose_var of `_shares` and `_pose_variance`: places of one scan are off by
    the error of the same pose. A part without places is on the line, and nobody knows how surely.
    """
    (shares, pose_var), ratio = noise, PARTS / (ends[1] - ends[0])
    off, variance = np.zeros(PARTS), np.full(PARTS, math.inf)
    for i in range(weighted.shape[1]):
        if weighted[2, i] > 0.0:
            part = min(int((weighted[0, i] - ends[0]) * ratio), PARTS - 1)
            off[part] += weighted[2, i] * (weighted[1, i] - fit.mean)
    for part in range(PARTS):
        weight, squared = shares[part].sum(), (shares[part] ** 2).sum()
        if weight > 0.0:
            off[part], variance[part] = off[part] / weight, (weight + pose_var * squared) / (weight * weight)
    return off, variance


@kernel
def _is_straight(places, fit, parts, parameters):
    """Tell whether no place and no part of a face is off its line.

    `places` are (window, normal, weighted), `parts` those of `_parts`.
    """
    (window, normal, weighted), (off, variance), joining = places, parts, parameters.least_joining
    for i in range(weighted.shape[1]):
        y = weighted[1, i] - fit.mean
        deviations = y * y * weighted[2, i]
        if deviations > OFF_LINE and (
            deviations > LONE_OFF_LINE or y > 0.0 or has_support(window, normal, i, -y, joining)
        ):
            return False
    return not (off**2 > OFF_LINE * variance).any()


@kernel
def _surely_ahead(parts):
    """Return by how much more than a standard deviation a part of a face is ahead of its line [m], at least 0.

    `parts` are off (PARTS,) and variance (PARTS,) of `_parts`. Noise may hide a corner or a step that no part shows by
    five deviations.
    """
    off, variance = parts
    return max((-off - np.sqrt(variance)).max(), 0.0)


@kernel
def _bulge(weighted, fit, ends):
    """Return how far the quadratic through a face surely comes nearer than its line, and the deviation of that [m]."""
    second, third, fourth = fit.spread / fit.weight, 0.0, 0.0
    for i in range(weighted.shape[1]):
        s = weighted[0, i] - fit.middle
        third += weighted[2, i] * s**3
        fourth += weighted[2, i] * s**4
    skew = third / fit.spread
    square, product = fourth - skew * third - second * fit.spread, 0.0
    if not square > 0.0:
        return 0.0, 0.0
    for i in range(weighted.shape[1]):
        s = weighted[0, i] - fit.middle
        product += weighted[2, i] * weighted[1, i] * (s * s - skew * s - second)
    bend, std, (low, high) = product / square, math.sqrt(1.0 / square), (ends[0] - fit.middle, ends[1] - fit.middle)
    reach = second + 0.25 * skew * skew  # of a convex face, whose middle is nearest; of a hollow one the ends are
    if bend < 0.0:
        reach = max(low * (low - skew), high * (high - skew)) - second
    return max(abs(bend) - std, 0.0) * reach, std * reach
