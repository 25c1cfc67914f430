"""What single beams say about a wall: where it ends, and whether it is still there.

A range is NaN without an echo, and -inf (hits.BLOCKED) where the robot itself is in the way: nearer than any wall.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

LEAST_COSINE = 0.15  # beams that meet the wall at a more grazing angle say nothing
IN_RANGE = 0.95  # of range_max: no echo is expected from farther
BEHIND = 0.1  # [m] an echo this far behind a wall passed it by; so much before it, something hid it
MARGIN = 0.05  # [m] from the ends of the stretch seen
FEWEST = 3  # beams on a wall that may speak against it
SHARE = 0.6  # of them must


@kernel
def beam_on_line(cos, sin, offset, beams, k):  # pragma: no cover - compiled
    """Return the coordinate along the line and the range where beam k meets it from the front, else inf.

    The line's normal is (cos, sin), the beams (B, 2) are unit vectors.
    """
    along = beams[k, 0] * cos + beams[k, 1] * sin
    if along < LEAST_COSINE or offset <= 0:
        return 0.0, math.inf
    distance = offset / along
    return distance * (beams[k, 1] * cos - beams[k, 0] * sin), distance


@kernel
def end_bounds(line, scan, rules):  # pragma: no cover - compiled
    """Return coordinates before and beyond which the wall of a sighting does not go; infinite for ends not free."""
    low = end_bound(line, scan, -1, rules) if line["free_low"] else -math.inf
    high = end_bound(line, scan, 1, rules) if line["free_high"] else math.inf
    return low, high


@kernel
def end_bound(line, scan, end, rules):  # pragma: no cover - compiled
    """Return a coordinate beyond which the wall of a sighting does not go, at its high (end = 1) or low (-1) end.

    It is where the first echo from behind came through, or where so many neighbours got no echo that they cannot all
    have been lost; the end itself when there is none. inf or -inf when the wall leaves the range first. The scan is
    (ranges (B,), beams (B, 2)).
    """
    ranges, directions = scan
    cos, sin, offset = math.cos(line["angle"]), math.sin(line["angle"]), line["offset"]
    edge = end * (line["high"] if end > 0 else line["low"])
    best, silent = math.inf, 0
    beams = len(ranges)
    at, start = -1, math.inf
    for k in range(beams):  # the first beam beyond the end
        s, distance = beam_on_line(cos, sin, offset, directions, k)
        if distance < math.inf and end * s > edge + 1e-9 and end * s < start:
            at, start = k, end * s
    k = at
    for _ in range(beams if at >= 0 else 0):
        s, distance = beam_on_line(cos, sin, offset, directions, k)
        if distance > IN_RANGE * rules.range_max or end * s < start:
            break
        r = ranges[k]
        if math.isnan(r):
            silent += 1
        elif r < distance - BEHIND:
            break  # something hides the rest
        else:
            silent = 0
        if silent >= rules.silent or r > distance + BEHIND:
            best = end * s
            break
        k = (k + end) % beams
    return end * best


@kernel
def contradicted(track, scan, rules):  # pragma: no cover - compiled
    """Return whether a scan shows that a wall is no longer where it was: beams that should meet it went past.

    Beams stopped before it say nothing. A scan without any echo says nothing: the sensor may be blind.
    """
    ranges, beams = scan
    cos, sin, offset = math.cos(track["angle"]), math.sin(track["angle"]), track["offset"]
    low, high = track["low"] + MARGIN, track["high"] - MARGIN
    on, past, echoes = 0, 0, 0
    for k in range(len(ranges)):
        r = ranges[k]
        if math.isfinite(r):
            echoes += 1
        s, distance = beam_on_line(cos, sin, offset, beams, k)
        if distance > IN_RANGE * rules.range_max - BEHIND or s < low or s > high:
            continue
        if math.isnan(r) or r > distance + BEHIND:
            past += 1
            on += 1
        elif r > distance - BEHIND:
            on += 1
    return echoes > 0 and on >= FEWEST and past >= SHARE * on
