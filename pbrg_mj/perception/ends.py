"""What the beams beside a wall say: does it end there, does it have a gap."""

from __future__ import annotations

import math

from numba import njit

from pbrg_mj.perception.hits import DX, DY, R
from pbrg_mj.perception.line_fit import LEAST_COSINE, weight_of

SURE = 4.0  # standard deviations beyond which a beam is clearly farther than the wall
WELL_WITHIN = 0.9  # of the range limit: a wall nearer than that would have been seen


@njit(cache=True)
def passes(points, rules, fit, b):  # pragma: no cover - compiled
    """Tell whether beam b is known to pass where the wall, continued, would be.

    It returned something clearly farther away, or nothing although the wall would be well within range. `fit` (7,) is
    theta, c, var theta, cov, var c, low, high. A beam that something nearer stopped knows nothing.
    """
    if not rules.closed and (b < 0 or b >= len(points)):
        return False
    b %= len(points)
    nx, ny, c = math.cos(fit[0]), math.sin(fit[0]), fit[1]
    cosine = nx * points[b, DX] + ny * points[b, DY]
    if cosine < LEAST_COSINE or c > cosine * WELL_WITHIN * rules.range_max:
        return False
    if not math.isfinite(points[b, R]):
        return True
    s = c * (nx * points[b, DY] - ny * points[b, DX]) / cosine
    variance = 1.0 / weight_of(rules, cosine, c) + s * s * fit[2] - 2.0 * s * fit[3] + fit[4]
    return points[b, R] * cosine - c > max(rules.split_distance, SURE * math.sqrt(variance))


@njit(cache=True)
def is_free(points, rules, fit, b, side):  # pragma: no cover - compiled
    """Tell whether the beams next to b, on its clockwise (side -1) or counter-clockwise (+1) side, all pass."""
    agreed = 0
    while agreed < rules.agree and passes(points, rules, fit, b + side * (agreed + 1)):
        agreed += 1
    return agreed == rules.agree


@njit(cache=True)
def has_gap(points, rules, fit, low, high):  # pragma: no cover - compiled
    """Tell whether neighbouring beams between `low` and `high`, counter-clockwise, agree that they pass the wall."""
    beams = len(points)
    between = (high - low) % beams - 1
    if between > beams // 2:  # the pieces overlap
        return False
    agreed = 0
    for k in range(1, between + 1):
        agreed = agreed + 1 if passes(points, rules, fit, (low + k) % beams) else 0
        if agreed >= rules.agree:
            return True
    return False
