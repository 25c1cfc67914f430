"""The last point of a line, where another surface goes on or hides one: it may be that surface's.

Split and merge gives the first point beyond a corner to a wall that it happens to suit. Where two lines meet, the
directions of beams say whose it is (corners.py), as well as they know the corner; where the other surface gives no
line, nothing does. Nor does anything where another line hides the corner: one beam alone may meet the wall beyond it.
Then the last point is foreign with the probability p that its residual leaves to it (Bayes): a corner lies anywhere
between two beams, so a foreign one lies anywhere between the line and the point after it. The line is the mixture of
that with all points and that without the last, and so is its covariance, to first order in both ends

    line + sum p_i delta_i,    P + sum p_i (P_i - P + (1 - p_i) delta_i delta_i'),

delta_i how far the line moves when point i is left out (as in Bar-Shalom's probabilistic data association).

The covariance of the errors counts the second last point, too. A wall that begins between the third last beam and the
second last is as likely a priori as one that begins a beam later, and that both are foreign follows from their
residuals, as above. The line is not moved for it, so delta delta' counts in full.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import (
    RESIDUAL,
    WEIGHT,
    S,
    covariance,
    extent,
    incidence_cosine,
    residual,
    weight_of,
    wrapped,
)
from pbrg_mj.perception.scan.points import MAX_LOST, apart
from pbrg_mj.perception.scan.robust_fit import OUTLIER

LEAST_LEFT = 3  # points of a line without its last two: through fewer any line goes
STEPS = 8  # of the place of a corner between two beams
LOG_2 = math.log(2.0)
SQRT_2PI = math.sqrt(2.0 * math.pi)


@kernel
def allow_for_corners(points, params, order, line, count, work):
    """Correct a line's fit (10,) for last points that may be another surface's; its beams are work.members[:count]."""
    fit, at = work.fits[line], work.at
    members = work.members[:count]
    moments = extent(points, params, members, (fit[0], fit[1]), at)
    moved = (0.0, 0.0)
    for k in range(3):
        fit[7 + k] = params.noise_share * fit[2 + k]
    for end in range(2):
        i = _last(at, count, end, -1)
        after = _after(order, members[i], 2 * end - 1)
        ends = (members[i], after) if end == 1 else (after, members[i])
        other = work.owner[after] >= 0 and work.owner[after] != line
        if _hides(points, params, ends, other) or not apart(points, params, ends[0], ends[1], 0):
            found = (moments, at, i, _last(at, count, end, i) if count >= LEAST_LEFT + 2 else -1)
            turn, shift = _correct(points, params, fit, found, after, work.odds[members[i]])
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
def _last(at, count, end, without):
    """Return which point is last at the low (0) or high (1) end of a line `without` one of them."""
    last = -1
    for i in range(count):
        if i != without and (last < 0 or (at[i, S] > at[last, S]) == (end == 1)):
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
    """Add to the covariances in `fit` for the last points, and return how far (theta, c) move.

    `found` are the moments of the line, its points `at` and the places of the last one and the one before it there, -1
    if that is surely the line's; `odds` those of the last to be foreign before its residual is known.
    """
    moments, at, i, second = found
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
    moved = (p * w * off * turn, p * w * off * shift)
    both, away, grows = 0.0, (0.0, 0.0), (0.0, 0.0, 0.0)
    if second >= 0:
        odds_of_two, away, grows = _without_two(moments, at, (i, second), offset)
        odds_of_two *= odds**2 * (1.0 - p)
        both = odds_of_two / (1.0 + odds_of_two)
    size = (1.0 - both) * p * w / kept * (params.noise_share + (1.0 - p) * w * kept * off * off)
    turn_off, shift_off = away[0] - moved[0], away[1] - moved[1]
    fit[7] += size * turn * turn + both * (params.noise_share * grows[0] + turn_off * turn_off)
    fit[8] += size * turn * shift + both * (params.noise_share * grows[1] + turn_off * shift_off)
    fit[9] += size * shift * shift + both * (params.noise_share * grows[2] + shift_off * shift_off)
    return moved


@kernel
def _without_two(moments, at, places, offset):
    """Return the odds that the last two points are foreign, against that none is, and what the line is without them.

    That is how far (theta, c) move, and how much less sure they are: aa, ac, cc. The `places` (2,) in `at` are those
    of the last point and the one before it, `offset` that of the point after them [m].
    """
    total, mean, spread = moments[0], moments[1], moments[2]
    paa, pac, pcc = covariance(total, mean, spread)
    s_i, s_k = at[places[0], S], at[places[1], S]
    root_i, root_k = math.sqrt(at[places[0], WEIGHT]), math.sqrt(at[places[1], WEIGHT])
    m_ii = 1.0 - root_i**2 * (1.0 / total + (s_i - mean) ** 2 / spread)  # of I less their part of the hat matrix
    m_kk = 1.0 - root_k**2 * (1.0 / total + (s_k - mean) ** 2 / spread)
    m_ik = -root_i * root_k * (1.0 / total + (s_i - mean) * (s_k - mean) / spread)
    det = max(m_ii * m_kk - m_ik**2, 1e-6)
    r_i, r_k = root_i * at[places[0], RESIDUAL], root_k * at[places[1], RESIDUAL]
    z_i, z_k = (m_kk * r_i - m_ik * r_k) / det, (m_ii * r_k - m_ik * r_i) / det  # from the line without them
    a_i, c_i = root_i * (paa * s_i - pac), root_i * (pac * s_i - pcc)
    a_k, c_k = root_k * (paa * s_k - pac), root_k * (pac * s_k - pcc)
    aa = (m_kk * a_i * a_i - 2.0 * m_ik * a_i * a_k + m_ii * a_k * a_k) / det
    ac = (m_kk * a_i * c_i - m_ik * (a_i * c_k + a_k * c_i) + m_ii * a_k * c_k) / det
    cc = (m_kk * c_i * c_i - 2.0 * m_ik * c_i * c_k + m_ii * c_k * c_k) / det
    odds = _odds_of_two((r_i, r_k), (m_ii, m_ik, m_kk), (root_i * offset, root_k * offset))
    return odds, (z_i * a_i + z_k * a_k, z_i * c_i + z_k * c_k), (aa, ac, cc)


@kernel
def _odds_of_two(residuals, matrix, offsets):
    """Return the likelihood that the last two points are foreign, in that of none.

    Of the last, i, and the one before, k: `residuals` r_i, r_k, `offsets` all_i, all_k of the point after them, all in
    standard deviations, and the `matrix` m_ii, m_ik, m_kk, I less the hat matrix.
    A wall that leaves the line at the share u of the way back from the second last beam to the third last goes away
    from it by the same d a beam. So the point after the last is at (2 + u) d, the last at (1 + u) d, the one before at
    u d. Whatever d, all are equally likely, so u has the density 1 / (2 + u), against log 2 where one is foreign.
    """
    (r_i, r_k), (m_ii, m_ik, m_kk), (all_i, all_k) = residuals, matrix, offsets
    odds = 0.0
    for step in range(STEPS):
        u = (step + 0.5) / STEPS
        mu_i, mu_k = all_i * (1.0 + u) / (2.0 + u), all_k * u / (2.0 + u)
        square = m_ii * mu_i**2 + 2.0 * m_ik * mu_i * mu_k + m_kk * mu_k**2
        odds += math.exp(min(r_i * mu_i + r_k * mu_k - 0.5 * square, 50.0)) / ((2.0 + u) * LOG_2 * STEPS)
    return odds


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
    off = residual(points, params, nx, ny, c, after)
    w = weight_of(params, incidence_cosine(points, params, nx, ny, after), c)
    return math.copysign(max(abs(off), OUTLIER / math.sqrt(w)), off)
