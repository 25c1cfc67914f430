"""How far the face of what comes nearer reaches to either side: where hand points are in its way.

A half-space has no ends; the face that it keeps off has. What echoes in a row is taken for one thing, whose end is
somewhere before the next beam. That something nearer may hide the rest of it does not count.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.corner_bound import MOST_LOST


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
    first, last = start, start
    for side in range(2):
        beam = echoes.joined[start, side]
        for _ in range(len(echoes.x)):
            if beam < 0 or beam == start:
                break
            along = nx * echoes.y[beam] - ny * echoes.x[beam]
            low, high = min(low, along), max(high, along)
            first, last = (beam, last) if side == 0 else (first, beam)
            beam = echoes.joined[beam, side]
    return low - _beyond(beams, first, -1, parameters), high + _beyond(beams, last, 1, parameters)


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
def _beyond(beams, end, step, parameters):
    """Return how far beside the last echo of a face, in a direction of beams, hand points are out of its way [m]."""
    for lost in range(1, 2 + MOST_LOST):
        other = next_beam(end, step * lost, parameters)
        if other < 0 or parameters.blocked[other]:
            return math.inf
        if not math.isnan(beams.ranges[other]):
            break
    return parameters.clearance + parameters.gap * beams.ranges[end]
