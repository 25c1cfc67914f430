"""Where a track ends: what the beams of one scan say, and what the track keeps of it.

A range is NaN without an echo, and -inf (points.BLOCKED) where the robot itself is in the way: nearer than any wall.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel

FAR = 100.0  # [m] a track whose end has not been seen goes on so far

SIGMAS = 3.0
MOST_END_MOVES = 6  # a moved end counts 2, a scan without one -1: lost beams may feign one now and then

LEAST_COSINE = 0.15  # beams that meet the line at a more grazing angle say nothing
IN_RANGE = 0.95  # of range_max: no echo is expected from farther


@kernel
def beam_on_line(cos, sin, offset, beams, k):
    """Return the coordinate along the line and the range where beam k meets it from the front, else inf.

    The line's normal is (cos, sin), the beams (B, 2) are unit vectors.
    """
    along = beams[k, 0] * cos + beams[k, 1] * sin
    if along < LEAST_COSINE or offset <= 0:
        return 0.0, math.inf
    distance = offset / along
    return distance * (beams[k, 1] * cos - beams[k, 0] * sin), distance


@kernel
def end_bounds(line, scan, params):
    """Return coordinates before and beyond which the line of a scan does not go; infinite for ends not free."""
    low = end_bound(line, scan, -1, params) if line["free_low"] else -math.inf
    high = end_bound(line, scan, 1, params) if line["free_high"] else math.inf
    return low, high


@kernel
def end_bound(line, scan, end, params):
    """Return a coordinate beyond which the line of a scan does not go, at its high (end = 1) or low (-1) end.

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
        if distance > IN_RANGE * params.range_max or end * s < start:
            break
        r = ranges[k]
        if math.isnan(r) and distance <= params.blind_range:
            break  # too near for an echo: so may be the rest
        if math.isnan(r):
            silent += 1
        elif r < distance - params.passed_by:
            break  # something hides the rest
        else:
            silent = 0
        if silent >= params.silent or r > distance + params.passed_by:
            best = end * s
            break
        k = (k + end) % beams
    return end * best


@kernel
def restart_extent(track, line, scan, now, params):
    """Set the track's extent to a line's, and count its age and motion from here."""
    track["low"], track["high"] = line["low"], line["high"]
    track["low_bound"], track["high_bound"] = end_bounds(line, scan, params)
    angle, middle = line["angle"], 0.5 * (line["low"] + line["high"])
    track["ref_angle"] = angle
    track["ref_x"] = now.x + line["offset"] * math.cos(angle) - middle * math.sin(angle)
    track["ref_y"] = now.y + line["offset"] * math.sin(angle) + middle * math.cos(angle)
    track["w0"] = track["w1"] = track["w2"] = track["e0"] = track["e1"] = track["end_blur"] = 0.0
    track["first"] = now.time
    _note_blur(track, line, (track["low_bound"], track["high_bound"]), params)


@kernel
def update_extent(track, line, scan, now, params):
    """Update the track's extent with a line's ends, or restart it when an end has moved."""
    low_bound, high_bound = end_bounds(line, scan, params)
    slack = params.end_tolerance + SIGMAS * math.sqrt(now.position_var)
    far = SIGMAS * math.sqrt(now.heading_var) * line["offset"]
    over = max(line["high"] - track["high_bound"], track["low_bound"] - line["low"])
    short = max(track["high"] - high_bound, low_bound - track["low"])
    if max(over, short) > slack + far:
        track["end_moves"] += 2
        if track["end_moves"] >= MOST_END_MOVES or not track["confirmed"]:
            restart_extent(track, line, scan, now, params)
            track["end_moves"] = track["confirmed"] = 0
            track["hits"] = 1
        return
    track["end_moves"] = max(track["end_moves"] - 1, 0)
    _note_blur(track, line, (low_bound, high_bound), params)
    track["low_bound"] = max(track["low_bound"], low_bound)
    track["high_bound"] = min(track["high_bound"], high_bound)
    widen_extent(track, line)


@kernel
def widen_extent(track, line):
    """Let a track reach as far as a line of it."""
    track["low"] = min(track["low"], line["low"])
    track["high"] = max(track["high"], line["high"])


@kernel
def _note_blur(track, line, bounds, params):
    """Keep the widest gap so far between the last beam on the thing and the first past it, at the better end.

    bounds (low, high) are those of `end_bounds` [m].
    """
    here = min(line["low"] - bounds[0], bounds[1] - line["high"])
    track["end_blur"] = max(track["end_blur"], min(here, params.end_uncertainty))


@kernel
def track_ends(track):
    """Return where a track begins and ends along t: beyond the extent seen, as far as no beam has passed it by."""
    low = min(track["low_bound"], track["low"]) if track["low_bound"] > -math.inf else track["low"] - FAR
    return low, max(track["high_bound"], track["high"]) if track["high_bound"] < math.inf else track["high"] + FAR
