"""A straight line through range points, with its covariance and how well it fits.

The line is n(theta) . p = c with n = (cos theta, sin theta) the normal away from the robot and c >= 0. Noise is along
the beams: a range error of variance sigma^2 gives the residual e_i = n . p_i - c the variance (n . d_i)^2 sigma^2, d_i
the beam's direction. sigma is taken at the range c / (n . d_i) that the line predicts, not at the one measured: else
points that happen to be near would weigh more.

`members` is (order, low, high, owner, a, b): the points order[low:high] that wall a or b owns.
"""

from __future__ import annotations

import math

from numba import njit

LEAST_COSINE = 0.1  # keeps the weight of a beam that runs along the line finite
FALSE_ALARM_SCORE = 3.09  # of a normal variable: the share 1e-3 of true walls that the residuals' test loses, per scan
MAX_BEND = 3.0  # standard deviations of the curvature


@njit(cache=True)
def weight_of(rules, cosine, c):  # pragma: no cover - compiled
    """Return 1 / variance [1/m^2] of the residual of a point whose beam meets the line (n, c) at n . d = cosine."""
    cosine_2 = max(cosine**2, LEAST_COSINE**2)
    return 1.0 / (cosine_2 * rules.range_std**2 + (rules.noise_ratio * c) ** 2)


@njit(cache=True)
def is_member(members, i):  # pragma: no cover - compiled
    """Tell whether the i-th point belongs to the line."""
    order, _, _, owner, a, b = members
    return owner[order[i]] == a or owner[order[i]] == b


@njit(cache=True)
def fit_line(scan, rules, members, guess):  # pragma: no cover - compiled
    """Return (theta, c) of the weighted total-least-squares line; `guess` (theta, c) is good enough for the weights.

    Once more with the weights of the first answer.
    """
    return _principal_axis(scan, rules, members, _principal_axis(scan, rules, members, guess))


@njit(cache=True)
def _principal_axis(scan, rules, members, guess):  # pragma: no cover - compiled
    directions, xy = scan[1], scan[2]
    order, low, high = members[0], members[1], members[2]
    nx, ny, c = math.cos(guess[0]), math.sin(guess[0]), guess[1]
    total = x = y = sxx = sxy = syy = 0.0
    for i in range(low, high):  # moments about the guess's foot point
        if is_member(members, i):
            b = order[i]
            w = weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c)
            px, py = xy[b, 0] - c * nx, xy[b, 1] - c * ny
            total += w
            x += w * px
            y += w * py
            sxx += w * px * px
            sxy += w * px * py
            syy += w * py * py
    x, y = x / total, y / total
    sxx, sxy, syy = sxx - total * x * x, sxy - total * x * y, syy - total * y * y
    # The scatter's longer axis is the line, the shorter one its normal.
    theta = 0.5 * math.atan2(2.0 * sxy, sxx - syy) + 0.5 * math.pi
    offset = math.cos(theta) * (x + c * nx) + math.sin(theta) * (y + c * ny)
    if offset < 0.0:
        theta, offset = theta + math.pi, -offset
    return (theta - 2.0 * math.pi if theta > math.pi else theta), offset


@njit(cache=True)
def chord_line(scan, first, last):  # pragma: no cover - compiled
    """Return (theta, c) of the line through the points of two beams, `last` counter-clockwise of `first`."""
    xy = scan[2]
    theta = math.atan2(xy[first, 0] - xy[last, 0], xy[last, 1] - xy[first, 1])
    c = math.cos(theta) * xy[first, 0] + math.sin(theta) * xy[first, 1]
    return (theta, c) if c >= 0.0 else (theta + math.pi, -c)


@njit(cache=True)
def extent(scan, rules, members, line):  # pragma: no cover - compiled
    """Return (total weight, weighted mean of s, weighted sum of (s - mean)^2, least s, largest s), s along the line."""
    directions, xy = scan[1], scan[2]
    order, first, last = members[0], members[1], members[2]
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    total = ws = wss = 0.0
    low, high = math.inf, -math.inf
    for i in range(first, last):
        if is_member(members, i):
            b = order[i]
            s = nx * xy[b, 1] - ny * xy[b, 0]
            w = weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c)
            total += w
            ws += w * s
            wss += w * s * s
            low, high = min(low, s), max(high, s)
    mean = ws / total
    return total, mean, wss - total * mean**2, low, high


@njit(cache=True)
def covariance(total, mean, spread):  # pragma: no cover - compiled
    """Return (var theta, cov, var c): the inverse of sum w (s, -1)(s, -1)', since de/dtheta = s and de/dc = -1."""
    return 1.0 / spread, mean / spread, 1.0 / total + mean**2 / spread


@njit(cache=True)
def worst_point(scan, rules, members, line, moments):  # pragma: no cover - compiled
    """Return (its deviation, i) of the point that fits least.

    Deviations are residuals in their own standard deviations: N(0, 1) each for points of a straight wall.
    """
    directions, xy = scan[1], scan[2]
    order, low, high = members[0], members[1], members[2]
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    total, mean, spread = moments[0], moments[1], moments[2]
    worst, index = -1.0, -1
    for i in range(low, high):
        if is_member(members, i):
            b = order[i]
            w = weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c)
            s = nx * xy[b, 1] - ny * xy[b, 0] - mean
            leverage = w * (1.0 / total + s * s / spread)
            deviation = abs(nx * xy[b, 0] + ny * xy[b, 1] - c) * math.sqrt(w / max(1.0 - leverage, 1e-6))
            if deviation > worst:
                worst, index = deviation, i
    return worst, index


@njit(cache=True)
def is_straight(scan, rules, members, line, moments):  # pragma: no cover - compiled
    """Tell whether the residuals are as small as noise makes them (chi-squared) and show no bend (N(0, 1)).

    The bend is the residuals' part along s^2, made orthogonal to a line.
    """
    directions, xy = scan[1], scan[2]
    order, low, high = members[0], members[1], members[2]
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    total, mean, spread = moments[0], moments[1], moments[2]
    cubes = 0.0
    for i in range(low, high):
        if is_member(members, i):
            b = order[i]
            u = nx * xy[b, 1] - ny * xy[b, 0] - mean
            cubes += weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c) * u**3
    misfit = bend = size = 0.0
    points = 0
    for i in range(low, high):
        if is_member(members, i):
            b = order[i]
            u = nx * xy[b, 1] - ny * xy[b, 0] - mean
            w = weight_of(rules, nx * directions[b, 0] + ny * directions[b, 1], c)
            residual = nx * xy[b, 0] + ny * xy[b, 1] - c
            basis = u * u - spread / total - cubes / spread * u
            misfit += w * residual**2
            bend += w * basis * residual
            size += w * basis**2
            points += 1
    return misfit <= chi_squared_limit(points - 2) and bend * bend <= MAX_BEND**2 * size


@njit(cache=True)
def chi_squared_limit(freedom):  # pragma: no cover - compiled
    """Return what a chi-squared variable exceeds once in a thousand (Wilson and Hilferty's approximation)."""
    k = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - k + FALSE_ALARM_SCORE * math.sqrt(k)) ** 3
