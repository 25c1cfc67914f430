"""The points of one scan, without lone outliers.

Kernels of this package take `points` (B, 6), one row a beam: x, y, range, direction x, y, variance of the range as
measured; a beam without a point has the range NaN, or BLOCKED. Points are named by the number of their beam; a list
of beams in use, counter-clockwise, is an `order`.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import DX, DY, VARIANCE, R, X, Y, chord_normal, displacement, ray

BLOCKED = -math.inf  # range of a beam that ends at its own robot: nearer than any wall, it says nothing of walls

MAX_LOST = 1  # beams between two points of one surface that did not meet it
BREAK_MARGIN = 3.0  # standard deviations of the difference of two ranges
CHORD_MARGIN = 3.5  # standard deviations of a point's distance from a chord


@kernel
def write_points(ranges, directions, params, points, order):
    """Write the points, and to `order` the beams that hit something; return how many there are."""
    count = 0
    for b in range(len(ranges)):
        r = ranges[b]
        points[b, X], points[b, Y], points[b, R] = r * directions[b, 0], r * directions[b, 1], r
        points[b, DX], points[b, DY] = directions[b, 0], directions[b, 1]
        points[b, VARIANCE] = range_variance(params, r)
        if math.isfinite(r):
            order[count] = b
            count += 1
    return count


@kernel
def range_variance(params, r):
    """Return sigma^2 [m^2] of a range r."""
    return params.range_std**2 + (params.noise_ratio * r) ** 2


@kernel
def apart(points, params, b, after, skipped):
    """Tell whether two points belong to different things, by an adaptive breakpoint.

    `after` follows b counter-clockwise; `skipped` beams between them do not count. A wall whose far point is met at
    a grazing angle spreads its points r sin(dphi) / sin(angle) apart, r the shorter range and dphi the angle
    between the beams (after Borges and Aldon, "Line extraction in 2D range images for mobile robotics", 2004).
    """
    if after <= b and not params.closed:
        return True
    lost = (after - b if after >= b else after - b + len(points)) - 1 - skipped
    sine = points[b, DX] * points[after, DY] - points[b, DY] * points[after, DX]
    if lost < 0 or lost > MAX_LOST or sine <= 0.0:
        return True
    noise = math.sqrt(points[b, VARIANCE] + points[after, VARIANCE])
    limit = min(points[b, R], points[after, R]) * sine / params.grazing + BREAK_MARGIN * noise
    x, y = points[after, X] - points[b, X], points[after, Y] - points[b, Y]
    return x * x + y * y > limit * limit


@kernel
def chord_error(points, params, ends, chord, b):
    """Return how far point b lies from the chord between `ends`, in what is allowed; negative on the robot's side.

    Allowed is the split distance, or more where the noise of the three points is larger. Within the split distance it
    is 0: nobody asks how far. `ends` (a, z) are beams, `chord` (nx, ny, length) is that of `chord_normal`.
    """
    a, z = ends
    nx, ny, length = chord
    px, py = points[b, X] - points[a, X], points[b, Y] - points[a, Y]
    if params.half_cone > 0.0:
        px, py = displacement(points, params.half_cone, (a, b), nx, ny)
    off = nx * px + ny * py
    if length == 0.0:
        return math.sqrt(px * px + py * py) / params.split_distance
    if abs(off) <= params.split_distance:
        return 0.0
    u = (nx * py - ny * px) / length
    variance = _across(points, params, b, nx, ny)
    variance += (1.0 - u) ** 2 * _across(points, params, a, nx, ny) + u**2 * _across(points, params, z, nx, ny)
    return off / max(params.split_distance, CHORD_MARGIN * math.sqrt(variance))


@kernel
def _across(points, params, b, nx, ny):
    dx, dy, _, _ = ray(points, params.half_cone, b, nx, ny)
    return points[b, VARIANCE] * (nx * dx + ny * dy) ** 2


@kernel
def without_outliers(points, params, order, count, kept):
    """Write to `kept` (B,) the points of `order` that are no lone outliers; return how many there are.

    A lone outlier has the same straight surface on both sides. So do two neighbours that are both NEARER than that
    surface: something thin stands before it. Two that are both farther may be a doorway and stay. `_side` answers for
    most points, without a root.
    """
    if count < 5:  # no two on each side
        for i in range(count):
            kept[i] = order[i]
        return count
    left = 0
    pair_before = False
    for i in range(-1, count):
        before, a = _nth(order, count, i - 2), _nth(order, count, i - 1)
        b, c = _nth(order, count, i), _nth(order, count, i + 1)
        y, z = _nth(order, count, i + 2), _nth(order, count, i + 3)
        pair = count > 5 and _side(points, params, a, y, b) < 0 and _side(points, params, a, y, c) < 0
        pair = pair and _is_pair(points, params, (before, a, b, c, y, z))
        lone = _side(points, params, a, c, b) != 0 and _is_lone(points, params, (before, a, b, c, y))
        if i >= 0 and not (pair or pair_before or lone):
            kept[left] = order[i]
            left += 1
        pair_before = pair
    return left


@kernel
def _nth(order, count, i):
    """Return the i-th beam of a ring of `count`, -count <= i < 2 count; a remainder takes a division."""
    return order[i - count if i >= count else i + count if i < 0 else i]


@kernel
def _side(points, params, a, z, b):
    """Return -1 if b may be off the chord a-z on the robot's side, 1 on the far side, 0 if it is on it.

    On it is surely on it, whatever is rounded: within 0.9995 of the split distance.
    """
    if params.half_cone > 0.0:
        error = chord_error(points, params, (a, z), chord_normal(points, params.half_cone, a, z), b)
        return 0 if error == 0.0 else -1 if error < 0.0 else 1
    x, y = points[z, X] - points[a, X], points[z, Y] - points[a, Y]
    cross = y * (points[b, X] - points[a, X]) - x * (points[b, Y] - points[a, Y])
    if cross * cross < 0.999 * params.split_distance**2 * (x * x + y * y):
        return 0
    return -1 if cross < 0.0 else 1


@kernel
def _is_lone(points, params, beams):
    """Tell whether the third of five points is off the surface that the others lie on."""
    before, a, b, z, after = beams
    error = chord_error(points, params, (a, z), chord_normal(points, params.half_cone, a, z), b)
    return abs(error) > 1.0 and _is_surface(points, params, (before, a, z, after), 1 if error < 0.0 else 0)


@kernel
def _is_pair(points, params, beams):
    """Tell whether the third and fourth of six points are nearer than the surface that the others lie on."""
    before, a, b, c, z, after = beams
    chord = chord_normal(points, params.half_cone, a, z)
    if chord_error(points, params, (a, z), chord, b) >= -1.0 or chord_error(points, params, (a, z), chord, c) >= -1.0:
        return False
    return _is_surface(points, params, (before, a, z, after), 2)


@kernel
def _is_surface(points, params, beams, hidden):
    """Tell whether four points lie on one surface, of which so many beams between the middle two are hidden."""
    before, a, z, after = beams
    if apart(points, params, before, a, 0) or apart(points, params, a, z, hidden) or apart(points, params, z, after, 0):
        return False
    chord = chord_normal(points, params.half_cone, before, after)
    first = chord_error(points, params, (before, after), chord, a)
    second = chord_error(points, params, (before, after), chord, z)
    return max(abs(first), abs(second)) <= 1.0
