"""A line through the points of one segment: outliers removed, straightness tested, covariance inflated.

An outlier beam returns anything within the limits. Those far from the line are removed; one that happens to lie near it
cannot be told from a point of the line. It is an outlier with the probability p_i that its residual leaves to it
(Bayes), and if it is, the line is the one without it. So to first order in the p_i the covariance grows by

    sum p_i (delta_i delta_i' + P_i - P),

delta_i how far the line moves when point i is left out, P_i - P how much less sure it then is (the spread of means and
the mean of spreads, as in Bar-Shalom's probabilistic data association).
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import X, Y, chord_normal
from pbrg_mj.perception.scan.cone_ends import drop_near_ends
from pbrg_mj.perception.scan.line_fit import (
    COSINE,
    RESIDUAL,
    WEIGHT,
    S,
    chi_squared_limit,
    chord_line,
    covariance,
    extent,
    fit_line,
    incidence_cosine,
    straightness,
    worst_point,
)
from pbrg_mj.perception.scan.points import range_variance

OUTLIER = 3.5  # standard deviations beyond which a point belongs to something else
MAX_OUTLIERS = 2  # a segment with more of them is no line, unless
OUTLIER_SHARE = 0.05  # they are no more than this of its points
FALSE_ALARM = 3.09  # score of a normal variable: a share of 1e-3 of straight walls fails the residuals' test, per scan
MAX_BEND, MAX_BEND_SHORT = 3.0, 2.0  # standard deviations of the curvature
KINK = math.radians(30.0)  # of two walls that are not to pass for one
# Evenly spread points with a kink in their middle are bent by sqrt(15) / 16 KINK / std on average, std that of their
# direction. Where that is less than 3 beyond MAX_BEND, noise lets some pass.
HIDES_KINK = math.sqrt(15.0) / 16.0 * KINK / (MAX_BEND + 3.0)  # [rad]
SHORT = 2.0  # least lengths up to which a segment may be a row of robots
LIMIT_MARGIN = 3.0  # standard deviations of a range from the range limit


@kernel
def fit_segment(points, params, members, at, fit):
    """Fit a line to the beams `members`, write `fit` (7,) and return how many of them it kept, first; 0: no line.

    `fit` is theta, c, var theta, cov, var c, low, high. Outliers are removed from `members`; `at` (B, 4) is scratch.
    """
    count = len(members)
    outliers = 0
    limit_checked, ends_checked = False, params.half_cone == 0.0
    while outliers <= max(MAX_OUTLIERS, OUTLIER_SHARE * len(members)):
        if count < params.min_points or _length(points, params, members[0], members[count - 1]) < params.min_length:
            return 0
        kept = members[:count]
        line = fit_line(points, params, kept, chord_line(points, params, kept[0], kept[-1]))
        if not ends_checked:
            ends_checked = True
            inside = drop_near_ends(points, params, kept, line)
            if inside < count:
                count = inside
                continue
        if not limit_checked:
            limit_checked = True
            inside = _drop_at_limit(points, params, kept, line)
            if inside < count:
                count = inside
                continue
        moments = extent(points, params, kept, line, at)
        worst, index = worst_point(at, count, moments)
        if worst <= OUTLIER:
            write_fit(line, moments, fit)
            misfit, bend = straightness(at, count, moments)
            return count if _is_straight(params, fit, misfit / chi_squared_limit(count - 2, FALSE_ALARM), bend) else 0
        for i in range(index, count - 1):
            members[i] = members[i + 1]
        count -= 1
        outliers += 1
    return 0


@kernel
def write_fit(line, moments, fit):
    """Write theta, c, var theta, cov, var c, low, high to `fit` (7,).

    `line` is theta, c; `moments` are total, mean, spread, low, high as for `extent`.
    """
    total, mean, spread, low, high = moments
    fit[0], fit[1] = line
    fit[2], fit[3], fit[4] = covariance(total, mean, spread)
    fit[5], fit[6] = low, high


@kernel
def _is_straight(params, fit, misfit, bend):
    """Return whether a segment is long, certain and straight enough; `misfit` is a share of what is allowed.

    A short segment may be a row of robots. It must be straighter, and not seen so obliquely that the gaps are hidden.
    So must one be whose noise may hide that it is two walls, which meet at an obtuse corner.
    """
    if fit[2] > params.direction_std**2 or misfit > 1.0 or bend > MAX_BEND:
        return False
    if fit[2] > HIDES_KINK**2 and bend > MAX_BEND_SHORT:
        return False
    if fit[6] - fit[5] >= SHORT * params.min_length:
        return True
    return bend <= MAX_BEND_SHORT and abs(fit[5] + fit[6]) <= 2.0 * params.oblique * fit[1]


@kernel
def _length(points, params, first, last):
    if params.half_cone > 0.0:
        return chord_normal(points, params.half_cone, first, last)[2]
    return math.hypot(points[last, X] - points[first, X], points[last, Y] - points[first, Y])


@kernel
def _drop_at_limit(points, params, members, line):
    """Take out points where the line is within noise of a range limit; return how many are left, first.

    There only ranges that happen to be too short are seen, or at the lower limit too long ones. The line decides, not
    the range: else it would be bent.
    """
    nx, ny = math.cos(line[0]), math.sin(line[0])
    left = 0
    for b in members:
        cosine = max(incidence_cosine(points, params, nx, ny, b), 1e-6)
        r = line[1] / cosine
        if r >= params.blind_range and r + LIMIT_MARGIN * math.sqrt(range_variance(params, r)) <= params.range_max:
            members[left] = b
            left += 1
    return left


HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


@kernel
def inflate_for_outliers(points, params, members, at, fit):
    """Inflate the covariance in `fit` (7,) of the line through the beams `members` (N,) for outliers among them."""
    total, mean, spread, _, _ = extent(points, params, members, (fit[0], fit[1]), at)
    paa, pac, pcc = fit[2], fit[3], fit[4]
    for i in range(len(members)):
        s, w = at[i, S], at[i, WEIGHT]
        kept = max(1.0 - w * (1.0 / total + (s - mean) ** 2 / spread), 1e-6)  # 1 - leverage
        square = w * at[i, RESIDUAL] ** 2 / kept
        p = _probability(params, square, math.sqrt(1.0 / (w * kept)) / max(at[i, COSINE], 1e-6))
        size = p * w * (square + 1.0) / kept
        turn, shift = paa * s - pac, pac * s - pcc  # P (s, -1)'
        fit[2] += size * turn * turn
        fit[3] += size * turn * shift
        fit[4] += size * shift * shift


@kernel
def _probability(params, square, std):
    """Return how likely a point is an outlier: its squared deviation, and the standard deviation of its range [m].

    Outliers are spread evenly, points of the line are Gaussian about where the others put it.
    """
    odds = params.outlier_density * std * math.exp(min(0.5 * square + HALF_LOG_2PI, 50.0))
    return odds / (1.0 + odds)
