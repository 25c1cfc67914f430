"""Which wall the points beside a corner belong to, by the directions of their beams.

Split and merge cuts where a point lies farthest out, so noise chooses, and points near the corner go to the wall that
they happen to suit. Both turn the lines, and no covariance counts it. Two lines that meet say better whose a point is:
a beam that passes the corner on one side meets the one wall, on the other side the other, whatever its range was.
Directions have no noise, so nothing is chosen by the noise of the points beside the corner but through the lines, which
rest on all of their points. Beams that are nearer to the corner than it is known are nobody's.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.cone import DX, DY
from pbrg_mj.perception.scan.line_fit import LEAST_COSINE, beam_incidence, extent, fit_line, weight_of
from pbrg_mj.perception.scan.points import apart
from pbrg_mj.perception.scan.robust_fit import OUTLIER, write_fit

AMBIGUOUS = 1.0  # standard deviations of a corner's direction within which a beam is nobody's
LEAST_AMBIGUOUS = 1e-9  # of it: nothing is divided by 0
MOST_BETWEEN = 3  # points of no line between those of two that meet


@kernel
def settle_corners(points, params, order, work, lines):
    """Give the points beside each corner to the wall that their beams meet, and fit those walls again, in place.

    `order` (N,) are the points of the scan in turn, `lines` how many lines `work.ranking` lists; work.owner (B,) names
    the line of each point.
    """
    for i in range(lines):
        work.moved[work.ranking[i]] = False
    for beam in order:
        work.odds[beam] = 1.0
    for k in range(len(order)):
        a = work.owner[order[k]]
        z = _next_owned(order, work.owner, k)
        if a >= 0 and z >= 0 and work.owner[order[z]] != a:
            _settle(points, params, order, (k, z), work)
    for i in range(lines):
        line = work.ranking[i]
        if work.moved[line]:
            _fit_again(points, params, order, line, work)


@kernel
def _next_owned(order, owner, k):
    """Return the place of the next point of a line, -1 if there is none near."""
    for step in range(1, min(MOST_BETWEEN + 2, len(order))):
        z = (k + step) % len(order)
        if owner[order[z]] >= 0:
            return z
    return -1


@kernel
def _settle(points, params, order, places, work):
    """Give the points of two lines to whom they belong.

    `places` (k, z) are those in `order` of the last point of the one and of the first of the other. Nothing changes
    where the lines do not meet, or where too few points would be left to either.
    """
    k, z = places
    a, b = work.owner[order[k]], work.owner[order[z]]
    if apart(points, params, order[k], order[z], (order[z] - order[k]) % len(points) - 1):
        return
    x, y, across = _corner(work.fits[a], work.fits[b], params.least_corner)
    distance = math.hypot(x, y)
    if distance <= 0.0 or not _meet(points, params, order, places, (x, y), work):
        return
    corner = (x / distance, y / distance, AMBIGUOUS * across / distance)
    for keep in (True, False):  # what each would lose is counted first
        lost_a = _reassign(points, params, order, (k, -1), b, corner, work, keep)
        lost_b = _reassign(points, params, order, (z, 1), a, corner, work, keep)
        if min(lost_a, lost_b) < 0:
            return
        if keep and not (_left(work, a, lost_a, params) and _left(work, b, lost_b, params)):
            return
        if not keep and lost_a + lost_b > 0:
            work.moved[a] = work.moved[b] = True
    _set_corner_odds(points, params, order, (z, 1), (b, a), corner, work)
    _set_corner_odds(points, params, order, (k, -1), (a, b), corner, work)


@kernel
def _set_corner_odds(points, params, order, place, lines, corner, work):
    """Set the odds that the last point of a line before a corner is beyond it: the corner is known so well.

    It is the first of the second of `lines` (own, other) before a point of the first, which is looked for from a
    `place` (i, direction) on. `corner` is x, y, the unit vector towards it, and ambiguous, how well it is known [rad].
    """
    i, direction = place
    i = _first_of(order, work.owner, i, direction, lines[0])
    beam = order[_first_of(order, work.owner, i, -direction, lines[1])]
    fits = work.fits[lines[1]], work.fits[lines[0]]
    own_side, ambiguous = _own_side(points, params, fits, beam, -direction, corner)
    beyond = 0.5 * math.erfc(AMBIGUOUS * own_side / max(ambiguous, LEAST_AMBIGUOUS) * math.sqrt(0.5))
    work.odds[beam] = beyond / (1.0 - beyond) if beyond < 1.0 else 1.0 / LEAST_AMBIGUOUS


@kernel
def _first_of(order, owner, i, direction, line):
    """Return the first place from i on, in a direction, whose point is a line's."""
    for _ in range(len(order)):
        if owner[order[i]] == line:
            break
        i = (i + direction) % len(order)
    return i


@kernel
def _reassign(points, params, order, place, other, corner, work, keep):
    """Give the points of the line of a place that are beyond the corner to the `other` line; return how many it loses.

    They are looked for from that `place` (i, direction) on; `corner` is x, y, ambiguous as for `_set_corner_odds`. With
    `keep` none is given away; -1 if one of them is not on the other line: then the two do not meet there, the one hides
    the other.
    """
    i, direction = place
    own, lost = work.owner[order[i]], 0
    for _ in range(len(order)):
        beam = order[i]
        if work.owner[beam] >= 0 and work.owner[beam] != own:
            break
        own_side, ambiguous = _own_side(points, params, (work.fits[own], work.fits[other]), beam, direction, corner)
        if own_side > ambiguous:
            break
        if work.owner[beam] == own:
            lost += 1
            if keep and not _is_on(points, params, work.fits[other], beam):
                return -1
            if not keep:
                work.owner[beam] = other if own_side < -ambiguous else -1
        i = (i + direction) % len(order)
    return lost


@kernel
def _own_side(points, params, fits, beam, direction, corner):
    """Return how far a beam is on its own wall's side of a corner, and what is ambiguous of that.

    For a ray it is the sine of the angle from it to the `corner` (x, y, ambiguous) in a direction, 1 for
    counter-clockwise. A cone tells of the wall that is nearer in its view: for it it is by how much its own one is [m],
    of two `fits` (own, other).
    """
    if params.half_cone == 0.0:
        x, y, ambiguous = corner
        return direction * (x * points[beam, DY] - y * points[beam, DX]), ambiguous
    own, own_variance = _expected_range(points, params, fits[0], beam)
    other, other_variance = _expected_range(points, params, fits[1], beam)
    return other - own, AMBIGUOUS * math.sqrt(own_variance + other_variance)


@kernel
def _expected_range(points, params, fit, beam):
    """Return the range at which a beam meets a line [m], and its variance by that of the line, `fit` (7,) [m^2]."""
    nx, ny = math.cos(fit[0]), math.sin(fit[0])
    cosine, s, _ = beam_incidence(points, params, nx, ny, fit[1], beam)
    cosine = max(cosine, LEAST_COSINE)
    return fit[1] / cosine, _variance_along(fit, s) / cosine**2


@kernel
def _meet(points, params, order, places, corner, work):
    """Tell whether the points of two lines are on both sides of a `corner` (x, y) of theirs.

    `places` (k, z) are those in `order` of a point of each. Cones tell a concave corner's walls alone: at a convex one
    many views have the corner itself nearest.
    """
    if params.half_cone == 0.0:
        return _between(points, order, places, work.owner, corner[0], corner[1])
    one, other = work.fits[work.owner[order[places[0]]]], work.fits[work.owner[order[places[1]]]]
    return math.sin(other[0] - one[0]) > 0.0


@kernel
def _is_on(points, params, fit, beam):
    """Tell whether a point is on a line, as far as its noise lets one tell."""
    nx, ny, c = math.cos(fit[0]), math.sin(fit[0]), fit[1]
    cosine, s, off = beam_incidence(points, params, nx, ny, c, beam)
    variance = 1.0 / weight_of(params, cosine, c) + _variance_along(fit, s)
    return cosine > LEAST_COSINE and off * off <= OUTLIER**2 * variance


@kernel
def _left(work, line, lost, params):
    """Tell whether a line keeps as many points as one needs."""
    count = -lost
    for owner in work.owner:
        count += owner == line
    return count >= params.min_points


@kernel
def _corner(one, other, least_sine):
    """Return where two lines meet, x, y [m], and its standard deviation across its direction [m]; 0s: nowhere.

    `one` (7,) and `other` (7,) are their fits; the sine of the angle between them is at least `least_sine` [-].
    """
    nx, ny, mx, my = math.cos(one[0]), math.sin(one[0]), math.cos(other[0]), math.sin(other[0])
    sine = nx * my - ny * mx
    if abs(sine) < least_sine:
        return 0.0, 0.0, 0.0
    x, y = (one[1] * my - other[1] * ny) / sine, (other[1] * nx - one[1] * mx) / sine
    distance = math.hypot(x, y)
    if distance <= 0.0:
        return 0.0, 0.0, 0.0
    tx, ty = -y / distance, x / distance
    # The corner moves by N^-1 e, with e how far each line moves there.
    by_one, by_other = (tx * my - ty * mx) / sine, (ty * nx - tx * ny) / sine
    variance = by_one**2 * _variance_at(one, x, y) + by_other**2 * _variance_at(other, x, y)
    return x, y, math.sqrt(variance)


@kernel
def _variance_at(fit, x, y):
    """Return the variance [m^2] of a line's place at x, y."""
    return _variance_along(fit, math.cos(fit[0]) * y - math.sin(fit[0]) * x)


@kernel
def _variance_along(fit, s):
    """Return the variance [m^2] of the place of a line, `fit` (7,), at a coordinate s along it [m]."""
    return max(fit[4] - 2.0 * s * fit[3] + s * s * fit[2], 0.0)


@kernel
def _between(points, order, places, owner, x, y):
    """Tell whether a corner x, y is between the first point of the one line and the last of the other.

    `places` (k, z) are those in `order` of a point of each.
    """
    k, z = places
    return _beyond(points, order, k, owner, -1, x, y) and _beyond(points, order, z, owner, 1, x, y)


@kernel
def _beyond(points, order, i, owner, direction, x, y):
    """Tell whether some point of the line of place i is farther out in a direction than a corner."""
    own = owner[order[i]]
    for _ in range(len(order)):
        beam = order[i]
        if owner[beam] >= 0 and owner[beam] != own:
            return False
        cross, dot = x * points[beam, DY] - y * points[beam, DX], x * points[beam, DX] + y * points[beam, DY]
        if dot > 0.0 and direction * cross > 0.0:
            return True
        i = (i + direction) % len(order)
    return False


@kernel
def _fit_again(points, params, order, line, work):
    """Fit a line to the points that are its own now."""
    count = 0
    for beam in order:
        if work.owner[beam] == line:
            work.members[count] = beam
            count += 1
    members, fit = work.members[:count], work.fits[line]
    found = fit_line(points, params, members, (fit[0], fit[1]))
    write_fit(found, extent(points, params, members, found, work.at), fit)
