"""A straight line through range points, with its covariance and how well it fits.

The line is n(theta) . p = c with n = (cos theta, sin theta) the normal away from the robot and c >= 0. Noise is along
the beams: a range error of variance sigma^2 gives the residual e_i = n . p_i - c the variance (n . d_i)^2 sigma^2, d_i
the beam's direction. sigma is taken at the range c / (n . d_i) that the line predicts, not at the one measured: else
points that happen to be near would weigh more.

So is a point's coordinate s_i along the line: it is taken where its beam meets the line. Measured, it shares the
range's error with the residual, which turns a line seen obliquely (total least squares are biased by about
- var theta * sum (s_i / c)). With predicted weights and coordinates, sum (s_i, -1) e_i / variance_i = 0 is the
quasi-likelihood equation of the ranges: unbiased whatever the noise, also when it grows with the range (Wedderburn,
"Quasi-likelihood functions, generalized linear models, and the Gauss-Newton method", 1974).

`members` (N,) are the beams of the line's points. `at` (B, 4) is where they meet a line, one row for each of them.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import X, Y, chord_normal, ray

S, WEIGHT, RESIDUAL, COSINE = range(4)  # columns of `at`
CONE_STEPS = 2  # more, of a fit to cones
LEAST_COSINE = 0.1  # keeps the weight of a beam that runs along the line finite


@kernel
def weight_of(params, cosine, c):
    """Return 1 / variance [1/m^2] of the residual of a point whose beam meets the line (n, c) at n . d = cosine."""
    cosine_2 = max(cosine**2, LEAST_COSINE**2)
    return 1.0 / (cosine_2 * params.range_std**2 + (params.noise_ratio * c) ** 2)


@kernel
def residual(points, params, nx, ny, c, b):
    """Return how far an echo is behind the line (n, c) [m], if it is of a wall like that."""
    _, _, x, y = ray(points, params.half_cone, b, nx, ny)
    return nx * x + ny * y - c


@kernel
def incidence_cosine(points, params, nx, ny, b):
    """Return the cosine of the incidence of a beam on a line of normal (nx, ny)."""
    dx, dy, _, _ = ray(points, params.half_cone, b, nx, ny)
    return nx * dx + ny * dy


@kernel
def beam_incidence(points, params, nx, ny, c, b):
    """Return (n . d, s, e) of a beam: the cosine of its incidence, where it meets the line and its residual [m].

    Where the beam of a point runs along the line, s is where the point is: they meet anywhere.
    """
    dx, dy, x, y = ray(points, params.half_cone, b, nx, ny)
    cosine, across = nx * dx + ny * dy, nx * dy - ny * dx
    error = nx * x + ny * y - c
    if cosine < LEAST_COSINE:
        return cosine, nx * y - ny * x, error
    return cosine, c * across / cosine, error


@kernel
def fit_line(points, params, members, guess):
    """Return (theta, c) of the line; `guess` (theta, c) is good enough for weights.

    Total least squares come near whatever the guess; one step from there solves the ranges' equations as well as the
    noise lets one tell. Where cones meet the line depends on it, so there it is done again.
    """
    line = _scored(points, params, members, _principal_axis(points, params, members, guess))
    if params.half_cone > 0.0:
        for _ in range(CONE_STEPS):
            line = _scored(points, params, members, _principal_axis(points, params, members, line))
    return line


@kernel
def _scored(points, params, members, line):
    """Return (theta, c) one step of Fisher scoring on from `line`."""
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    total = ws = wss = we = wse = 0.0
    for b in members:
        cosine, s, error = beam_incidence(points, params, nx, ny, c, b)
        w = weight_of(params, cosine, c)
        total += w
        ws += w * s
        wss += w * s * s
        we += w * error
        wse += w * s * error
    mean = ws / total
    spread = wss - total * mean**2
    if spread <= 0.0:
        return line
    turn = (mean * we - wse) / spread
    return _outward(line[0] + turn, c + we / total + mean * turn)


@kernel
def _outward(theta, c):
    """Return the line (theta, c) with c >= 0 and theta in [-pi, pi]."""
    if c < 0.0:
        theta, c = theta + math.pi, -c
    return wrapped(theta), c


@kernel
def _principal_axis(points, params, members, guess):
    nx, ny, c = math.cos(guess[0]), math.sin(guess[0]), guess[1]
    total = x = y = sxx = sxy = syy = 0.0
    for b in members:  # moments about the guess's foot point
        dx, dy, x_b, y_b = ray(points, params.half_cone, b, nx, ny)
        w = weight_of(params, nx * dx + ny * dy, c)
        px, py = x_b - c * nx, y_b - c * ny
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
    return _outward(theta, math.cos(theta) * (x + c * nx) + math.sin(theta) * (y + c * ny))


@kernel
def chord_line(points, params, first, last):
    """Return (theta, c) of the line through the points of two beams, `last` counter-clockwise of `first`."""
    if params.half_cone > 0.0:
        nx, ny, _ = chord_normal(points, params.half_cone, first, last)
        return _outward(math.atan2(ny, nx), residual(points, params, nx, ny, 0.0, first))
    theta = math.atan2(points[first, X] - points[last, X], points[last, Y] - points[first, Y])
    c = math.cos(theta) * points[first, X] + math.sin(theta) * points[first, Y]
    return (theta, c) if c >= 0.0 else (theta + math.pi, -c)


@kernel
def extent(points, params, members, line, at):
    """Return the moments of a line: total weight, mean of s, sum of (s - mean)^2, least and largest s [m].

    s is along the line, sums and means are weighted. What it takes of each point is written to `at`, for all who ask
    more of the line: the divisions are what costs.
    """
    nx, ny, c = math.cos(line[0]), math.sin(line[0]), line[1]
    total = ws = wss = 0.0
    low, high = math.inf, -math.inf
    for i in range(len(members)):
        b = members[i]
        cosine, s, error = beam_incidence(points, params, nx, ny, c, b)
        w = weight_of(params, cosine, c)
        at[i, S], at[i, WEIGHT], at[i, RESIDUAL], at[i, COSINE] = s, w, error, cosine
        total += w
        ws += w * s
        wss += w * s * s
        low, high = min(low, s), max(high, s)
    mean = ws / total
    return total, mean, wss - total * mean**2, low, high


@kernel
def covariance(total, mean, spread):
    """Return (var theta, cov, var c): the inverse of sum w (s, -1)(s, -1)', since de/dtheta = s and de/dc = -1."""
    return 1.0 / spread, mean / spread, 1.0 / total + mean**2 / spread


@kernel
def worst_point(at, count, moments):
    """Return (its deviation, its place in `at`) of the point that fits least of `count`.

    Deviations are residuals in their own standard deviations: N(0, 1) each for points of a straight wall.
    """
    total, mean, spread = moments[0], moments[1], moments[2]
    worst, index = -1.0, -1
    for i in range(count):
        w = at[i, WEIGHT]
        leverage = w * (1.0 / total + (at[i, S] - mean) ** 2 / spread)
        deviation = abs(at[i, RESIDUAL]) * math.sqrt(w / max(1.0 - leverage, 1e-6))
        if deviation > worst:
            worst, index = deviation, i
    return worst, index


@kernel
def straightness(at, count, moments):
    """Return (misfit, bend) of N = `count` points: for a straight wall chi-squared with N - 2 degrees, and |N(0, 1)|.

    The misfit is the weighted sum of squared residuals; the bend is their part along s^2, made orthogonal to a line.
    """
    total, mean, spread = moments[0], moments[1], moments[2]
    cubes = 0.0
    for i in range(count):
        cubes += at[i, WEIGHT] * (at[i, S] - mean) ** 3
    misfit = bend = size = 0.0
    for i in range(count):
        w, u, residual = at[i, WEIGHT], at[i, S] - mean, at[i, RESIDUAL]
        basis = u * u - spread / total - cubes / spread * u
        misfit += w * residual**2
        bend += w * basis * residual
        size += w * basis**2
    return misfit, abs(bend) / math.sqrt(size) if size > 0.0 else 0.0


@kernel
def chi_squared_limit(freedom, score):
    """Return what a chi-squared variable exceeds as often as N(0, 1) exceeds `score` (Wilson and Hilferty)."""
    k = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - k + score * math.sqrt(k)) ** 3


@kernel
def wrapped(angle):
    """Return an angle [rad] in [-pi, pi]."""
    return angle - 2 * math.pi * round(angle / (2 * math.pi))
