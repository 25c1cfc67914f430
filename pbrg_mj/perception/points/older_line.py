"""The line of a face in an older scan, long enough that the noise of its two ends hardly turns it."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.parameters import JOINING

STEADY = 4.0  # deviations of its ends that a line is long: their noise turns it by 14 deg, one deviation
WIDENINGS = 12  # beams to either side of a line, at most
OFF_LINE = 1.0  # squared deviations that echoes between may be off it: noise hides no corner that sticks out farther


@kernel
def may_share_face(past, a, b, parameters):
    """Tell whether two echoes of an older scan may be of one face.

    By the farther range, unlike in `detect`: more lines tell of rest, and gates drop those from thing to thing.
    """
    if not (past[a]["external"] and past[b]["external"]):
        return False
    x, y, far = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"], max(past[a]["range"], past[b]["range"])
    noise = past[a]["variance"] + past[b]["variance"]
    near = max(JOINING * parameters.gap * far, parameters.least_joining)
    return math.sqrt(x * x + y * y) <= near + 3.0 * math.sqrt(noise)


@kernel
def long_line(past, a, b, parameters):
    """Return two echoes on either side of a and b whose line noise hardly turns, and how far a, b lie off it [m].

    They are those of a and b themselves where the scan goes on with nothing else, or with another face.
    """
    first, last, bent = a, b, 0.0
    for _ in range(WIDENINGS):
        if is_steady(past, first, last):
            break
        before, after = next_beam(first, -1, parameters), next_beam(last, 1, parameters)
        if before < 0 or before == last or not may_share_face(past, before, first, parameters):
            before = first
        if after < 0 or after == before or not may_share_face(past, last, after, parameters):
            after = last
        off = max(_off(past, before, after, a), _off(past, before, after, b))
        noise = past[before]["variance"] + past[after]["variance"]
        if (before == first and after == last) or off * off > OFF_LINE * noise:
            break
        first, last, bent = before, after, off
    return first, last, bent


@kernel
def is_steady(past, a, b):
    """Tell whether the line of two echoes is `STEADY`."""
    x, y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
    return x * x + y * y >= STEADY**2 * (past[a]["variance"] + past[b]["variance"])


@kernel
def _off(past, a, b, k):
    """Return how far an echo k lies off the line of two others [m]."""
    x, y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0
    return abs((past[k]["x"] - past[a]["x"]) * y - (past[k]["y"] - past[a]["y"]) * x) / length
