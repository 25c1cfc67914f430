"""How far the face of what comes nearer reaches to either side: where hand points are in its way.

A half-space has no ends; the face that it keeps off has. Echoes are taken for one thing's as long as each is as near to
the one before as two of a face at 60 deg are, or `LEAST_JOINING`; up to two beams between them may have lost it. Its
end is somewhere before the next beam. That something nearer may hide the rest of it does not count.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.corner_bound import MOST_LOST
from pbrg_mj.perception.points.parameters import LEAST_JOINING

MOST_SKIPPED = 2  # beams in a row: outliers, and echoes lost


@kernel
def face_span(seen, normal, place, parameters):
    """Return from where to where along (-ny, nx) a hand point is in the way of the face at a place (2,) [m].

    An end that no beam looks at is infinite. `seen` are a scan's echoes and its beams.
    """
    (echoes, beams), (nx, ny) = seen, normal
    start = _nearest_echo(echoes, place)
    if start < 0:
        return -math.inf, math.inf
    low = high = nx * echoes.y[start] - ny * echoes.x[start]
    beyond_low = beyond_high = 0.0
    for step in (-1, 1):
        end = start
        for _ in range(len(echoes.x)):
            beam = _next_of_face(echoes, beams.ranges, end, step, parameters)
            if beam < 0 or beam == start:
                break
            along, end = nx * echoes.y[beam] - ny * echoes.x[beam], beam
            low, high = min(low, along), max(high, along)
        if step < 0:
            beyond_low = _beyond(beams.ranges, end, step, parameters)
        else:
            beyond_high = _beyond(beams.ranges, end, step, parameters)
    return low - beyond_low, high + beyond_high


@kernel
def _next_of_face(echoes, ranges, beam, step, parameters):
    """Return the beam of the next echo of the same thing in a direction of beams, -1: none."""
    for lost in range(MOST_SKIPPED + 1):
        other = next_beam(beam, step * (lost + 1), parameters)
        if other < 0:
            break
        if echoes.binds[other]:
            x, y = echoes.x[other] - echoes.x[beam], echoes.y[other] - echoes.y[beam]
            limit = max(min(ranges[beam], ranges[other]) * parameters.joining[min(lost, MOST_LOST)], LEAST_JOINING)
            if x * x + y * y <= limit * limit:
                return other
    return -1


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
def _beyond(ranges, end, step, parameters):
    """Return how far beside the last echo of a face, in a direction of beams, hand points are out of its way [m]."""
    other = next_beam(end, step, parameters)
    if other < 0 or parameters.blocked[other]:
        return math.inf
    return parameters.clearance + ranges[end] * parameters.joining[0]
