"""What the beams beside a line say: does it end there, does it have a gap."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import R, ray
from pbrg_mj.perception.scan.line_fit import LEAST_COSINE, incidence_cosine, weight_of
from pbrg_mj.perception.scan.points import BLOCKED

CLEARLY_FARTHER = 4.0  # standard deviations beyond which a beam is clearly farther than the line
RANGE_SHARE = 0.9  # of the range limit: a line nearer than that would have been seen


@kernel
def beam_passes(points, params, fit, b):
    """Tell whether beam b is known to pass where the line, continued, would be.

    It returned something clearly farther away, or nothing although the line would be well within its limits. `fit` (7,)
    is theta, c, var theta, cov, var c, low, high. A beam that something nearer or the robot itself stopped knows
    nothing.
    """
    if not params.closed and (b < 0 or b >= len(points)):
        return False
    b %= len(points)
    nx, ny, c = math.cos(fit[0]), math.sin(fit[0]), fit[1]
    cosine = incidence_cosine(points, params, nx, ny, b)
    if cosine < LEAST_COSINE or c > cosine * RANGE_SHARE * params.range_max:
        return False
    if not math.isfinite(points[b, R]):
        return points[b, R] != BLOCKED and c > cosine * params.blind_range
    s = _along(points, params, fit, b)
    variance = 1.0 / weight_of(params, cosine, c) + s * s * fit[2] - 2.0 * s * fit[3] + fit[4]
    return points[b, R] * cosine - c > max(params.split_distance, CLEARLY_FARTHER * math.sqrt(variance))


@kernel
def is_free(points, params, fit, b, side):
    """Tell whether a line truly ends at beam b: enough beams next to it pass, on its side -1 (clockwise) or +1."""
    start = _along(points, params, fit, b)
    for k in range(1, len(points) // 2):
        if not beam_passes(points, params, fit, b + side * k):
            return False
        if k >= params.agree and abs(_along(points, params, fit, b + side * k) - start) >= params.least_gap:
            return True
    return False


@kernel
def has_gap(points, params, fit, low, high):
    """Tell whether enough neighbouring beams between `low` and `high`, counter-clockwise, pass the line."""
    between = (high - low) % len(points) - 1
    if between > len(points) // 2:  # the segments overlap
        return False
    agreed, start = 0, low
    for b in range(low + 1, low + 1 + between):
        if not beam_passes(points, params, fit, b):
            agreed, start = 0, b
            continue
        agreed += 1
        if (
            agreed >= params.agree
            and _along(points, params, fit, b) - _along(points, params, fit, start) >= params.least_gap
        ):
            return True
    return False


@kernel
def _along(points, params, fit, b):
    """Return where beam b meets the line, along t = (-sin, cos) [m]."""
    b %= len(points)
    nx, ny = math.cos(fit[0]), math.sin(fit[0])
    dx, dy, _, _ = ray(points, params.half_cone, b, nx, ny)
    return fit[1] * (nx * dy - ny * dx) / max(nx * dx + ny * dy, LEAST_COSINE)
