"""Which straight pieces of a scan are walls."""

from __future__ import annotations

import math

from numba import njit

from pbrg_mj.perception.hits import DX, DY, X, Y, range_variance
from pbrg_mj.perception.line_fit import chord_line, covariance, extent, fit_line, is_straight, worst_point

OUTLIER = 3.5  # standard deviations beyond which a point belongs to something else
MAX_OUTLIERS = 2  # a piece with more of them is no wall, unless
OUTLIER_SHARE = 0.05  # they are no more than this of its points
LIMIT_MARGIN = 3.0  # standard deviations of a range from the range limit


@njit(cache=True)
def fit_wall(points, rules, members, fit):  # pragma: no cover - compiled
    """Fit a wall to the beams `members`, write `fit` (7,) and return how many of them it kept, first; 0: no wall.

    `fit` is theta, c, var theta, cov, var c, low, high. Outliers are taken out of `members`.
    """
    count = len(members)
    outliers = 0
    limit_checked = False
    while outliers <= max(MAX_OUTLIERS, OUTLIER_SHARE * len(members)):
        if count < rules.min_points or _length(points, members[0], members[count - 1]) < rules.min_length:
            return 0
        kept = members[:count]
        line = fit_line(points, rules, kept, chord_line(points, kept[0], kept[-1]))
        if not limit_checked:
            limit_checked = True
            inside = _drop_at_limit(points, rules, kept, line)
            if inside < count:
                count = inside
                continue
        moments = extent(points, rules, kept, line)
        worst, index = worst_point(points, rules, kept, line, moments)
        if worst <= OUTLIER:
            write_fit(line, moments, fit)
            return count if is_straight(points, rules, kept, line, moments) else 0
        for i in range(index, count - 1):
            members[i] = members[i + 1]
        count -= 1
        outliers += 1
    return 0


@njit(cache=True)
def write_fit(line, moments, fit):  # pragma: no cover - compiled
    """Write theta, c, var theta, cov, var c, low, high."""
    total, mean, spread, low, high = moments
    fit[0], fit[1] = line
    fit[2], fit[3], fit[4] = covariance(total, mean, spread)
    fit[5], fit[6] = low, high


@njit(cache=True)
def _length(points, first, last):  # pragma: no cover - compiled
    return math.hypot(points[last, X] - points[first, X], points[last, Y] - points[first, Y])


@njit(cache=True)
def _drop_at_limit(points, rules, members, line):  # pragma: no cover - compiled
    """Take out points where the line is within noise of the range limit; return how many are left, first.

    There only ranges that happen to be too short are seen. The line decides, not the range: else it would be bent.
    """
    nx, ny = math.cos(line[0]), math.sin(line[0])
    left = 0
    for b in members:
        cosine = max(nx * points[b, DX] + ny * points[b, DY], 1e-6)
        r = line[1] / cosine
        if r + LIMIT_MARGIN * math.sqrt(range_variance(rules, r)) <= rules.range_max:
            members[left] = b
            left += 1
    return left
