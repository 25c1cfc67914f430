"""What points that may be strays add to a line's covariance.

A stray beam returns anything within the limits. Those far from the line have been taken out; one that happens to lie
near it cannot be told from a point of the wall. It is a stray with the probability p_i that its residual leaves to it
(Bayes), and if it is, the line is the one without it. So to first order in the p_i the covariance grows by

    sum p_i (delta_i delta_i' + P_i - P),

delta_i how far the line moves when point i is left out, P_i - P how much less sure it then is (the spread of means and
the mean of spreads, as in Bar-Shalom's probabilistic data association).
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.line_fit import COSINE, RESIDUAL, WEIGHT, S, extent

HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)


@kernel
def add_strays(points, rules, members, at, fit):  # pragma: no cover - compiled
    """Add to the covariance in `fit` (7,) of the line through the beams `members` (N,) what strays among them mean."""
    total, mean, spread, _, _ = extent(points, rules, members, (fit[0], fit[1]), at)
    paa, pac, pcc = fit[2], fit[3], fit[4]
    for i in range(len(members)):
        s, w = at[i, S], at[i, WEIGHT]
        kept = max(1.0 - w * (1.0 / total + (s - mean) ** 2 / spread), 1e-6)  # 1 - leverage
        square = w * at[i, RESIDUAL] ** 2 / kept
        p = _probability(rules, square, math.sqrt(1.0 / (w * kept)) / max(at[i, COSINE], 1e-6))
        size = p * w * (square + 1.0) / kept
        turn, shift = paa * s - pac, pac * s - pcc  # P (s, -1)'
        fit[2] += size * turn * turn
        fit[3] += size * turn * shift
        fit[4] += size * shift * shift


@kernel
def _probability(rules, square, std):  # pragma: no cover - compiled
    """Return how likely a point is a stray: its squared deviation, and the standard deviation of its range [m].

    Strays are spread evenly, points of the wall are Gaussian about where the others put it.
    """
    odds = rules.strays * std * math.exp(min(0.5 * square + HALF_LOG_2PI, 50.0))
    return odds / (1.0 + odds)
