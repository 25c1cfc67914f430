"""When a track is confirmed: a long one when seen twice, a short one when it cannot be moving.

A short extent may be the face of something that moves. Its speed along the normal is estimated by weighted least
squares from its sightings. A slide along itself shows at an end once it is longer than about twice the gap between
the last beam on the thing and the first past it. It is confirmed when `rest_speed` is ruled out both ways.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped
from pbrg_mj.perception.track.extent import SIGMAS

WIDE_RATIO = 6.0  # of extent without an end in sight and distance: a near wall shows only a short extent
MIN_SIGHTINGS = 3  # sightings of a short track


@kernel
def note_motion(track, line, now):
    """Add a sighting to the sums that give the track's speed along its normal."""
    angle = line["angle"]
    x, y = track["ref_x"] - now.x, track["ref_y"] - now.y
    cos, sin = math.cos(angle), math.sin(angle)
    s = y * cos - x * sin
    ahead = math.cos(wrapped(angle - track["ref_angle"]))
    e = (line["offset"] - x * cos - y * sin) / max(ahead, 0.5)
    w = 1 / (line["c_cc"] - 2 * s * line["c_ac"] + s * s * line["c_aa"])
    tau = now.time - track["first"]
    track["w0"] += w
    track["w1"] += w * tau
    track["w2"] += w * tau * tau
    track["e0"] += w * e
    track["e1"] += w * tau * e


@kernel
def confirm(track, line, now, params):
    """Confirm a track if it cannot be moving."""
    if track["confirmed"]:
        return
    length = line["high"] - line["low"]
    ended = line["free_low"] or line["free_high"]
    wide, long = not ended and length >= WIDE_RATIO * line["offset"], params.long_extent
    large = length >= long or wide if track["hits"] > 1 else now.elapsed == 0 and (length >= 2 * long or wide)
    track["confirmed"] = 1 if large or (is_at_rest_across(track, params) and _is_at_rest_along(track, params)) else 0


@kernel
def is_at_rest_across(track, params):
    """Return whether a speed of `rest_speed` along the normal is ruled out."""
    w0, w1, w2 = track["w0"], track["w1"], track["w2"]
    det = w0 * w2 - w1 * w1
    if track["hits"] < MIN_SIGHTINGS or det <= 0:
        return False
    speed = (w0 * track["e1"] - w1 * track["e0"]) / det
    return abs(speed) + SIGMAS * math.sqrt(w0 / det) < params.rest_speed


@kernel
def _is_at_rest_along(track, params):
    """Return whether a slide at `rest_speed` since the first sighting would have shown at an end.

    It shows when the first beam past the thing meets it, or the last on it does not, and by one beam late.
    """
    shows = (1 + 1 / params.silent) * track["end_blur"] + 4 * params.end_tolerance
    return (track["seen"] - track["first"]) * params.rest_speed > shows
