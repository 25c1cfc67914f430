"""How far the face of what comes nearer reaches to either side: where hand points are in its way.

A half-space has no ends; the face that it keeps off has. Echoes are taken for one thing's as long as each is as near to
the one before as two of a face at 60 deg are, or `least_joining`; up to two beams between them may have lost it. Its
end is somewhere before the next beam. That something nearer may hide the rest of it does not count.

Beams have no echo of what is nearer than their shortest range (blind_zone.py). So echoes on both sides of silent beams
are one thing's if both are at that range. If only one is, what it is of goes on, along the half-space, as far as it is
nearer than that.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import (
    are_across_scan_start,
    echo_across_blind_zone,
    is_beside_blind_zone,
    next_beam,
)
from pbrg_mj.perception.points.corner_bound import MOST_LOST

MOST_SKIPPED = 2  # beams in a row: outliers, and echoes lost


@kernel
def face_span(seen, normal, place, pose, parameters):
    """Return from where to where along (-ny, nx) a hand point is in the way of the face at a place (2,) [m].

    An end that no beam looks at is infinite. `seen` are `Echoes` and `SeenBeams`.
    """
    (echoes, _), (nx, ny) = seen, normal
    start = _nearest_echo(echoes, place)
    if start < 0:
        return -math.inf, math.inf
    low = high = nx * echoes.y[start] - ny * echoes.x[start]
    for step in (-1, 1):
        end = start
        for _ in range(len(echoes.x)):
            beam = _next_of_face(seen, end, step, pose, parameters)
            if beam < 0 or beam == start:
                break
            along, end = nx * echoes.y[beam] - ny * echoes.x[beam], beam
            low, high = min(low, along), max(high, along)
        beyond = _beyond(seen, (end, step), normal, pose, parameters)
        low, high = (low - beyond, high) if step < 0 else (low, high + beyond)
    return low, high


@kernel
def _next_of_face(seen, beam, step, pose, parameters):
    """Return the beam of the next echo of the same thing in a direction of beams, -1: none."""
    (echoes, (ranges, _)), least = seen, parameters.least_joining
    for lost in range(MOST_SKIPPED + 1):
        other = next_beam(beam, step * (lost + 1), parameters)
        if other < 0:
            break
        if echoes.binds[other]:
            x, y = echoes.x[other] - echoes.x[beam], echoes.y[other] - echoes.y[beam]
            limit = max(min(ranges[beam], ranges[other]) * parameters.joining[min(lost, MOST_LOST)], least)
            if x * x + y * y <= limit * limit:
                return other
    return echo_across_blind_zone(echoes, ranges, (beam, step), pose, parameters)


@kernel
def _nearest_echo(echoes, place):
    """Return the beam of the echo that binds nearest to a place (2,), -1 for none."""
    nearest, best = -1, math.inf
    for i in range(len(echoes.x)):
        squared = (echoes.x[i] - place[0]) ** 2 + (echoes.y[i] - place[1]) ** 2
        if echoes.binds[i] and squared < best:
            nearest, best = i, squared
    return nearest


@kernel
def _beyond(seen, last, normal, pose, parameters):
    """Return how far beside the last echo of a face, along (-ny, nx), hand points are out of its way [m].

    `last` are the beam of that echo and the step, 1 or -1, to the next beam.
    """
    (echoes, (ranges, directions)), (end, step), (nx, ny) = seen, last, normal
    other = next_beam(end, step, parameters)
    if other < 0 or parameters.blocked[other]:
        return math.inf
    reach = ranges[end] * parameters.joining[0]
    if are_across_scan_start(end, other, parameters):
        cos = directions[end, 0] * directions[other, 0] + directions[end, 1] * directions[other, 1]
        reach *= max(math.acos(min(max(cos, -1.0), 1.0)) / parameters.gap, 1.0)
    if math.isnan(ranges[other]) and is_beside_blind_zone(ranges[end], echoes.variance[end], pose, parameters):
        ahead = ranges[end] * (nx * echoes.ux[end] + ny * echoes.uy[end])
        aside = ranges[end] * (nx * echoes.uy[end] - ny * echoes.ux[end])
        reach += max(math.sqrt(max(parameters.range_min**2 - ahead * ahead, 0.0)) - step * aside, 0.0)
    return parameters.clearance + reach
