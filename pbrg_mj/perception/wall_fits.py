"""Which straight pieces of a scan are walls."""

from __future__ import annotations

import math

from numba import njit

from pbrg_mj.perception.hits import range_variance
from pbrg_mj.perception.line_fit import (
    chord_line,
    covariance,
    extent,
    fit_line,
    is_member,
    is_straight,
    worst_point,
)

OUTLIER = 3.5  # standard deviations beyond which a point belongs to something else
MAX_OUTLIERS = 2  # a piece with more of them is no wall, unless
OUTLIER_SHARE = 0.05  # they are no more than this of its points
LIMIT_MARGIN = 3.0  # standard deviations of a range from the range limit


@njit(cache=True)
def fit_wall(scan, rules, order, piece, owner, fit, ends):  # pragma: no cover - compiled
    """Fit a wall (start, stop, its number) and write `fit` (7,) and `ends` (2,); return False if it is none.

    Its points are those of the piece that `owner` gives its number; outliers lose it. `fit` is theta, c, var theta,
    cov, var c, low, high; `ends` are the beams of the first and the last point.
    """
    low, high, number = piece
    members = (order, low, high, owner, number, number)
    for i in range(low, high):
        owner[order[i]] = number
    outliers = 0
    while outliers <= max(MAX_OUTLIERS, OUTLIER_SHARE * (high - low)):
        count, first, last = _span(members)
        if count < rules.min_points or _length(scan[2], first, last) < rules.min_length:
            return False
        line = fit_line(scan, rules, members, chord_line(scan, first, last))
        if outliers == 0 and _drop_at_limit(scan, rules, members, line):
            continue
        moments = extent(scan, rules, members, line)
        worst, index = worst_point(scan, rules, members, line, moments)
        if worst <= OUTLIER:
            write_fit(line, moments, fit)
            ends[0], ends[1] = first, last
            return is_straight(scan, rules, members, line, moments)
        owner[order[index]] = -1
        outliers += 1
    return False


@njit(cache=True)
def write_fit(line, moments, fit):  # pragma: no cover - compiled
    """Write theta, c, var theta, cov, var c, low, high."""
    total, mean, spread, low, high = moments
    fit[0], fit[1] = line
    fit[2], fit[3], fit[4] = covariance(total, mean, spread)
    fit[5], fit[6] = low, high


@njit(cache=True)
def _span(members):  # pragma: no cover - compiled
    """Return how many points the wall has, and the beams of the first and the last."""
    order, low, high = members[0], members[1], members[2]
    count, first, last = 0, -1, -1
    for i in range(low, high):
        if is_member(members, i):
            first = order[i] if count == 0 else first
            last = order[i]
            count += 1
    return count, first, last


@njit(cache=True)
def _length(xy, first, last):  # pragma: no cover - compiled
    return math.hypot(xy[last, 0] - xy[first, 0], xy[last, 1] - xy[first, 1])


@njit(cache=True)
def _drop_at_limit(scan, rules, members, line):  # pragma: no cover - compiled
    """Take out points where the line is within noise of the range limit; tell whether there were any.

    There only ranges that happen to be too short are seen. The line decides, not the range: else it would be bent.
    """
    directions = scan[1]
    order, low, high, owner = members[0], members[1], members[2], members[3]
    nx, ny = math.cos(line[0]), math.sin(line[0])
    dropped = False
    for i in range(low, high):
        if is_member(members, i):
            b = order[i]
            cosine = max(nx * directions[b, 0] + ny * directions[b, 1], 1e-6)
            r = line[1] / cosine
            if r + LIMIT_MARGIN * math.sqrt(range_variance(rules, r)) > rules.range_max:
                owner[b] = -1
                dropped = True
    return dropped
