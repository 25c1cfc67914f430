"""The last point of a line, where another surface goes on or hides one: it may be that surface's.

Split and merge gives the first point beyond a corner to a wall that it happens to suit. Where two lines meet, the
directions of beams say whose it is (corners.py), as well as they know the corner; where the other surface gives no
line, nothing does. Nor does anything where another line hides the corner: one beam alone may meet the wall beyond it.
Then the last point is foreign with the probability p that its residual leaves to it (Bayes): a corner lies anywhere
between two beams, so a foreign one lies anywhere between the line and the point after it. The line is the mixture of
that with all points and that without the last, and so is its covariance, to first order in both ends

    line + sum p_i delta_i,    P + sum p_i (P_i - P + (1 - p_i) delta_i delta_i'),

delta_i how far the line moves when point i is left out (as in Bar-Shalom's probabilistic data association).
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import RESIDUAL, WEIGHT, S, covariance, extent, weight_of, wrapped
from pbrg_mj.perception.scan.points import DX, DY, MAX_LOST, X, Y, apart
from pbrg_mj.perception.scan.robust_fit import OUTLIER

SQRT_2PI = math.sqrt(2.0 * math.pi)


@kernel
def allow_for_corners(points, params, order, line, count, work):
    """Correct a line's fit (7,) for last points that may be another surface's; its beams are work.members[:count]."""
    fit, at = work.fits[line], work.at
    members = work.members[:count]
    moments = extent(points, params, members, (fit[0], fit[1]), at)
    moved = (0.0, 0.0)
    for end in range(2):
        i = _last(at, count, end)
        after = _after(order, members[i], 2 * end - 1)
        ends = (members[i], after) if end == 1 else (after, members[i])
        other = work.owner[after] >= 0 and work.owner[after] != line
        if _hides(points, params, ends, other) or not apart(points, params, ends[0], ends[1], 0):
            turn, shift = _correct(points, params, fit, (moments, at, i), after, work.odds[members[i]])
            moved = (moved[0] + turn, moved[1] + shift)
    fit[0], fit[1] = wrapped(fit[0] + moved[0]), fit[1] + moved[1]


@kernel
def _hides(points, params, ends, other):
    """Tell whether a point of another line is next to a line's last: a corner may be hidden between their beams.

    `ends` (b, after) are the beams of both. What is round, as robots are, stands free and gives no line.
    """
    if not other or (ends[1] <= ends[0] and not params.closed):
        return False
    return (ends[1] - ends[0]) % len(points) <= 1 + MAX_LOST


@kernel
def _last(at, count, end):
    """Return which point is last at the low (0) or high (1) end of a line."""
    last = 0
    for i in range(1, count):
        if (at[i, S] > at[last, S]) == (end == 1):
            last = i
    return last


@kernel
def _after(order, beam, direction):
    """Return the beam of the point after that of `beam` in a direction, -1 (clockwise) or 1."""
    for i in range(len(order)):
        if order[i] == beam:
            return order[(i + direction) % len(order)]
    return beam


@kernel
def _correct(points, params, fit, found, after, odds):
    """Add to the covariance in `fit` for one last point, and return how far (theta, c) move.

    `found` are the moments of the line, its points `at` and the place of the last one there; `odds` those of it to be
    foreign before its residual is known.
    """
    moments, at, i = found
    total, mean, spread = moments[0], moments[1], moments[2]
    s, w = at[i, S], at[i, WEIGHT]
    kept = max(1.0 - w * (1.0 / total + (s - mean) ** 2 / spread), 1e-6)  # 1 - leverage
    paa, pac, pcc = covariance(total, mean, spread)
    turn, shift = paa * s - pac, pac * s - pcc  # P (s, -1)'
    off = at[i, RESIDUAL] / kept  # from the line without it
    offset, deviation = _offset_after(points, params, fit, after), off * math.sqrt(w * kept)
    p = _probability(deviation, offset * math.sqrt(w * kept), odds)
    size = p * w / kept * (1.0 + (1.0 - p) * w * kept * off * off)
    fit[2] += size * turn * turn
    fit[3] += size * turn * shift
    fit[4] += size * shift * shift
    return p * w * off * turn, p * w * off * shift


@kernel
def _probability(deviation, offset, odds):
    """Return how likely a point is foreign: its deviation and its offset, both in standard deviations.

    A foreign one is spread evenly over the offset, and its own noise reaches beyond.
    """
    beside = deviation if offset > 0.0 else -deviation
    density = 0.5 * math.erfc(-beside * math.sqrt(0.5)) / abs(offset)
    odds *= density * SQRT_2PI * math.exp(min(0.5 * deviation * deviation, 50.0))
    return odds / (1.0 + odds)


@kernel
def _offset_after(points, params, fit, after):
    """Return the offset of the point after the last [m], no nearer than its noise reaches: it is not on the line."""
    nx, ny, c = math.cos(fit[0]), math.sin(fit[0]), fit[1]
    off = nx * points[after, X] + ny * points[after, Y] - c
    w = weight_of(params, nx * points[after, DX] + ny * points[after, DY], c)
    return math.copysign(max(abs(off), OUTLIER / math.sqrt(w)), off)
