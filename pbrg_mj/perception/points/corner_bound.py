"""How far a right-angled corner between two beams may stick out beyond the echo beside it.

An echo on the line through its neighbours is beside none. Beside another the corner lies no farther out than half the
way to the next beam, in whatever direction (Thales). Where the echo and two others in a row lie on a line, it is on a
face that is known, and so is the corner: no farther along it than the next beam, and not before it; nor farther than a
gap between beams at that range, since the echo on its other face is nearer to it then. Where no echo follows, a thing
may end anywhere up to the next beam; no more than half a gap is counted, or robots with few beams would pass no doorway
(docs/points.md, "What is let in too near"). Echoes of several scans at one place share what one of them knows: a
neighbour that was lost once makes no corner. What is beyond its own next beam it does not know.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam

OFF_LINE = 16.0  # squared standard deviations: of the 400 echoes in a memory none is off the line by chance
ROUNDING = 1e-9  # [m] of exact ranges
ALONG = 2.0  # how far a face goes while beams go 1 across: echoes on it are joined up to 60 degrees of incidence
MOST_LOST = 1  # beams without an echo between two of one thing


class CornerBound(NamedTuple):
    """Upper bounds of how far it sticks out: `protrusion`, and in the direction g (unit) |g . along| + slack [m]."""

    protrusion: float  # [m]
    along_x: float  # [m]
    along_y: float  # [m]
    slack: float  # [m]


@kernel
def corner_bound(echoes, ranges, k, joins, parameters):
    """Return the `CornerBound` of a corner between the beam of echo k and those beside it.

    `joins` are the numbers of the echoes before and after it on the same thing, -1 for none.
    """
    before, after = joins
    if before >= 0 and after >= 0 and _on_a_line(echoes, before, k, after):
        return CornerBound(0.0, 0.0, 0.0, 0.0)
    protrusion = 0.5 * parameters.unseen * ranges[k]
    before, after = _next_external(echoes, k, -1, parameters), _next_external(echoes, k, 1, parameters)
    if before >= 0 and after >= 0 and before != after and _on_a_line(echoes, before, k, after):
        x, y, _ = _way(echoes, before, after)
        half = 0.5 * max(_way(echoes, before, k)[2], _way(echoes, k, after)[2])
        way = min(half, 2.0 * protrusion)
        return CornerBound(protrusion, way * x, way * y, 0.0)
    for step, near in ((-1, after), (1, before)):
        far = _next_external(echoes, near, -step, parameters) if near >= 0 else -1
        if far < 0 or far == k or not _on_a_line(echoes, far, near, k):
            continue
        x, y, length = _way(echoes, far, k)
        beam = echoes.ux[k], echoes.uy[k]
        way = min(_to_the_next_beam(ranges[k], beam, (x, y), step, parameters.unseen), 2.0 * protrusion)
        turned = math.sqrt(_across(echoes, k, x, y) + _across(echoes, far, x, y)) / length
        return CornerBound(protrusion, way * x, way * y, min(parameters.sigmas * turned * way, protrusion))
    return CornerBound(protrusion, 0.0, 0.0, protrusion)


@kernel
def share_corner_bounds(points, beams):
    """Let echoes at one place, those of the beam that met it last, share what each of them tells of a corner.

    An echo tells nothing of what is beyond its own next beam. So for one aside of it, towards the side on which that
    one has no neighbour, the bounds grow by as much as its next beam meets the face later.
    """
    last, before = np.full(beams, -1), np.full(len(points), -1)  # echoes of a beam, each with the one before it
    for i in range(len(points)):
        point = points[i]
        if point["live"] and point["beam"] >= 0:
            before[i], last[point["beam"]] = last[point["beam"]], i
    for i in range(len(points)):
        point = points[i]
        if point["slack"] > 0.0 and point["live"] and point["beam"] >= 0:
            k = last[point["beam"]]
            while k >= 0:
                _learn_of_corner(point, points[k])
                k = before[k]


@kernel
def _learn_of_corner(point, other):
    """Let a point know what another one at its place tells of a corner.

    The point's corner is on the side of `along`, or on either.
    """
    aside = point["ux"] * (other["y"] - point["y"]) - point["uy"] * (other["x"] - point["x"])
    side = point["ux"] * point["along_y"] - point["uy"] * point["along_x"]
    if side != 0.0:
        aside = max(-aside if side > 0.0 else aside, 0.0)
    untold = ALONG * abs(aside)
    point["protrusion"] = min(other["protrusion"] + untold, point["protrusion"])
    if other["slack"] + untold < point["slack"]:
        point["slack"] = other["slack"] + untold
        point["along_x"], point["along_y"] = other["along_x"], other["along_y"]


@kernel
def _on_a_line(echoes, a, k, b):
    """Tell whether echo k is on the line through the echoes a and b as far as ranges are known."""
    x, y = echoes.x[b] - echoes.x[a], echoes.y[b] - echoes.y[a]
    dx, dy, squared = echoes.x[k] - echoes.x[a], echoes.y[k] - echoes.y[a], x * x + y * y
    if squared == 0.0:
        return False
    share, off = (dx * x + dy * y) / squared, dx * y - dy * x
    variance = (1.0 - share) ** 2 * _across(echoes, a, x, y) + share**2 * _across(echoes, b, x, y)
    return off * off <= OFF_LINE * (variance + _across(echoes, k, x, y)) + ROUNDING**2 * squared


@kernel
def _way(echoes, a, b):
    """Return the direction from echo a to echo b, and how far it is [m]."""
    x, y = echoes.x[b] - echoes.x[a], echoes.y[b] - echoes.y[a]
    length = math.sqrt(x * x + y * y)
    return x / length, y / length, length


@kernel
def _across(echoes, k, x, y):
    """Return the variance of an echo's range across a vector, times the square of its length."""
    across = echoes.ux[k] * y - echoes.uy[k] * x
    return echoes.variance[k] * across * across


@kernel
def _next_external(echoes, k, step, parameters):
    """Return the next echo's beam in a direction, -1 where too many beams in a row have none."""
    for lost in range(1, 2 + MOST_LOST):
        other = next_beam(k, step * lost, parameters)
        if other < 0 or other == k:
            return -1
        if echoes.external[other]:
            return other
    return -1


@kernel
def _to_the_next_beam(reach, beam, face, step, gap):
    """Return how far a face goes on from an echo at `reach` to the next beam [m]; inf where it never meets it.

    beam (2,) and face (2,) are unit vectors along them, `gap` [rad].
    """
    ahead = beam[0] * face[0] + beam[1] * face[1]
    aside = step * (beam[0] * face[1] - beam[1] * face[0])
    meets = aside * math.cos(gap) - ahead * math.sin(gap)
    return reach * math.sin(gap) / meets if meets > 0.0 else math.inf
