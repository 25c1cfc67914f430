"""The points of one scan, without lone outliers.

Compiled functions of this room take a `scan` (ranges (B,), directions (B, 2), xy (B, 2), closed): points are named by
the number of their beam, and `order` lists those in use, counter-clockwise. B beams; `closed` tells that the last beam
is next to the first.
"""

from __future__ import annotations

import math

from numba import njit

GRAZING = math.sin(math.radians(10.0))  # sine of the flattest angle at which a beam is taken to meet a wall
BREAK_MARGIN = 3.0  # standard deviations of the difference of two ranges
CHORD_MARGIN = 3.5  # standard deviations of a point's distance from a chord


@njit(cache=True)
def hits_into(ranges, directions, xy, order):  # pragma: no cover - compiled
    """Write the points of all finite ranges and the numbers of their beams; return how many there are."""
    count = 0
    for b in range(len(ranges)):
        if math.isfinite(ranges[b]):
            xy[b, 0] = ranges[b] * directions[b, 0]
            xy[b, 1] = ranges[b] * directions[b, 1]
            order[count] = b
            count += 1
    return count


@njit(cache=True)
def is_closed(directions):  # pragma: no cover - compiled
    """Tell whether the last beam is about as far from the first one as the first one is from the second."""
    beams = len(directions)
    if beams < 3:
        return False
    return _angle(directions, beams - 1, 0) < 1.5 * _angle(directions, 0, 1)


@njit(cache=True)
def _angle(directions, b, after):  # pragma: no cover - compiled
    (x0, y0), (x1, y1) = directions[b], directions[after]
    return math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1) % (2.0 * math.pi)


@njit(cache=True)
def range_variance(rules, r):  # pragma: no cover - compiled
    """Return sigma^2 [m^2] of a range r."""
    return rules.range_std**2 + (rules.noise_ratio * r) ** 2


@njit(cache=True)
def apart(scan, rules, b, after, skipped):  # pragma: no cover - compiled
    """Tell whether two points belong to different things, by an adaptive breakpoint.

    `after` follows b counter-clockwise; `skipped` points between them do not count. A wall whose far point is met at
    the angle GRAZING spreads its points r sin(dphi) / sin(GRAZING) apart, r the shorter range and dphi the angle
    between the beams (after Borges and Aldon, "Line extraction in 2D range images for mobile robotics", 2004).
    """
    ranges, directions, xy, closed = scan
    if after <= b and not closed:
        return True
    lost = (after - b) % len(ranges) - 1 - skipped
    sine = directions[b, 0] * directions[after, 1] - directions[b, 1] * directions[after, 0]
    if lost < 0 or lost >= rules.agree or sine <= 0.0:
        return True
    noise = math.sqrt(range_variance(rules, ranges[b]) + range_variance(rules, ranges[after]))
    limit = min(ranges[b], ranges[after]) * sine / GRAZING + BREAK_MARGIN * noise
    return math.hypot(xy[after, 0] - xy[b, 0], xy[after, 1] - xy[b, 1]) > limit


@njit(cache=True)
def chord_error(scan, rules, a, z, b):  # pragma: no cover - compiled
    """Return how far point b lies from the chord a-z, in what is allowed; negative on the robot's side.

    Allowed is the split distance, or more where the noise of the three points is larger.
    """
    directions, xy = scan[1], scan[2]
    x, y = xy[z, 0] - xy[a, 0], xy[z, 1] - xy[a, 1]
    px, py = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1]
    length = math.hypot(x, y)
    if length == 0.0:
        return math.hypot(px, py) / rules.split_distance
    nx, ny = y / length, -x / length  # away from the robot when z follows a counter-clockwise
    off = nx * px + ny * py
    if abs(off) <= rules.split_distance:
        return off / rules.split_distance
    u = (x * px + y * py) / length**2
    variance = _across(scan, rules, b, nx * directions[b, 0] + ny * directions[b, 1])
    variance += (1.0 - u) ** 2 * _across(scan, rules, a, nx * directions[a, 0] + ny * directions[a, 1])
    variance += u**2 * _across(scan, rules, z, nx * directions[z, 0] + ny * directions[z, 1])
    return off / max(rules.split_distance, CHORD_MARGIN * math.sqrt(variance))


@njit(cache=True)
def _across(scan, rules, b, cosine):  # pragma: no cover - compiled
    return range_variance(rules, scan[0][b]) * cosine**2


@njit(cache=True)
def without_spikes(scan, rules, order, count, kept):  # pragma: no cover - compiled
    """Write to `kept` the points of `order` that are no lone outliers; return how many there are.

    A lone outlier has the same straight surface on both sides. So do two neighbours that are both NEARER than that
    surface: something thin stands before it. Two that are both farther may be a doorway and stay.
    """
    left = 0
    for i in range(count):
        lone = _spike(scan, rules, order, count, i, 1)
        pair = _spike(scan, rules, order, count, i, 2) or _spike(scan, rules, order, count, i - 1, 2)
        if not (lone or pair):
            kept[left] = order[i]
            left += 1
    return left


@njit(cache=True)
def _spike(scan, rules, order, count, i, size):  # pragma: no cover - compiled
    """Tell whether `size` points from the i-th on are off the surface that the two points on each side lie on."""
    if count < size + 4:
        return False
    before, a = order[(i - 2) % count], order[(i - 1) % count]
    z, after = order[(i + size) % count], order[(i + size + 1) % count]
    for k in range(i, i + size):
        error = chord_error(scan, rules, a, z, order[k % count])
        if abs(error) <= 1.0 or (size > 1 and error > 0.0):
            return False
    if apart(scan, rules, before, a, 0) or apart(scan, rules, a, z, size) or apart(scan, rules, z, after, 0):
        return False
    across = abs(chord_error(scan, rules, before, after, a)), abs(chord_error(scan, rules, before, after, z))
    return max(across[0], across[1]) <= 1.0
