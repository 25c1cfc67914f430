"""The beams of a scan, and which of them looks in a direction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel

ROUGH = 2e-5  # [rad] by which a rough angle may be wrong: 1e-5 by its formula, the rest for rounding
PER_RADIAN = 1.0 / (2.0 * math.pi)  # turns
TINY = 1e-300  # [m]


class SeenBeams(NamedTuple):
    """One scan of one robot in its body frame as it was at the end of the scan."""

    ranges: np.ndarray  # (beams,) [m]
    directions: np.ndarray  # (beams, 2) unit vectors


@kernel
def layout(parameters):
    """Return what tells a beam's direction, without the rest: handing over all parameters takes longer than its use."""
    return parameters.first, parameters.gap, len(parameters.directions), parameters.closed


@kernel
def nearest_beam(x, y, rough, layout):
    """Return the beam nearest to the direction of (x, y) in the body frame, -1 for none within half a gap.

    `rough` is the `roughly_ahead` of (x, y), `layout` that of `layout`: first [rad], gap [rad], how many beams, closed.
    For beams that are apart evenly; where a scan takes time, `nearest_from` goes on from there.
    """
    first, gap, beams, closed = layout
    ahead = _exactly_ahead(x, y, (0.0, first, gap), rough, 0.5)
    beam = math.floor(ahead + 0.5)
    if closed:
        beam = _all_round(beam, beams)
    elif beam >= beams:
        per_turn = 2.0 * math.pi / gap
        ahead = _exactly_ahead(x, y, (0.0, first, gap), ahead, 0.5 - per_turn)
        beam = 0 if per_turn - ahead < 0.5 else -1
    return beam


@kernel
def beams_beside(x, y, heading, directions, parameters):
    """Return the beams on either side of the direction (x, y) for a robot that heads [rad], -1 where there are none."""
    beams = len(parameters.directions)
    rough = roughly_ahead(x, y, heading + parameters.first, parameters.gap)
    a = math.floor(_exactly_ahead(x, y, (heading, parameters.first, parameters.gap), rough, 0.0))
    if parameters.closed:
        a = _all_round(a, beams)
    elif a + 1 >= beams:
        return -1, -1
    if parameters.scan_time > 0.0:
        cos, sin = math.cos(heading), math.sin(heading)
        x, y = cos * x + sin * y, cos * y - sin * x
        a = nearest_from(a, x, y, directions, parameters)
        if directions[a, 0] * y - directions[a, 1] * x < 0.0:
            a = next_beam(a, -1, parameters)
        return (a, next_beam(a, 1, parameters)) if a >= 0 else (-1, -1)
    return a, next_beam(a, 1, parameters)


@kernel
def roughly_ahead(x, y, first, gap):
    """Return how many gaps [rad] the direction (x, y) is ahead of an angle [rad]; its angle is wrong by up to `ROUGH`.

    It is that of Abramowitz and Stegun (1964, 4.4.47). There is neither a branch in it nor a call of a library nor a
    division that looks for zeros: the processor takes four directions at a time, and need not guess.
    """
    wide, high = abs(x), abs(y)
    t = np.true_divide(min(wide, high), max(wide, high, TINY))
    s = t * t
    angle = t * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))))
    angle = 0.5 * math.pi - angle if high > wide else angle
    angle = math.pi - angle if x < 0.0 else angle
    turns = ((-angle if y < 0.0 else angle) - first) * PER_RADIAN
    return (turns - np.floor(turns)) * np.true_divide(2.0 * math.pi, gap)


@kernel
def _exactly_ahead(x, y, layout, rough, edge):
    """Return what `roughly_ahead` does, `rough`, and exactly where floor(ahead + edge) might differ.

    `layout` are heading, first and gap: of the robot, of the first beam and between beams [rad].
    """
    heading, first, gap = layout
    per_turn = 2.0 * math.pi / gap
    doubt = ROUGH * PER_RADIAN * per_turn
    if abs(rough + edge - np.floor(rough + edge + 0.5)) > doubt and doubt < rough < per_turn - doubt:
        return rough
    turns = (math.atan2(y, x) - heading - first) / (2.0 * math.pi)
    return (turns - math.floor(turns)) * 2.0 * math.pi / gap


@kernel
def next_beam(k, step, parameters):
    """Return the beam so many after beam k, -1 where beams do not go all the way round."""
    beams, other = len(parameters.directions), k + step
    if parameters.closed:
        return _all_round(other, beams)
    return other if 0 <= other < beams else -1


@kernel
def are_across_scan_start(a, b, parameters):
    """Tell whether a scan that takes time begins between two beams that are few beams apart.

    Where the robot turned meanwhile no beam looked at some of what is between them, or both looked at it.
    """
    return parameters.scan_time > 0.0 and 2 * abs(a - b) > len(parameters.directions)


@kernel
def is_beside_blind_zone(reach, variance, pose, parameters):
    """Tell whether the next place on a face may be nearer than beams tell, whose echo here is at `reach` [m].

    That is of a face at 60 deg, and `variance` [m^2] the range's. In a scan that takes time, ranges are those from
    where the robot was at its end (deskew.py), and it may have been nearer.
    """
    moved = math.sqrt(pose.shift_x**2 + pose.shift_y**2) if parameters.scan_time > 0.0 else 0.0
    return reach * (1.0 - parameters.joining[0]) - 3.0 * math.sqrt(variance) - moved <= parameters.range_min


@kernel
def echo_across_blind_zone(echoes, ranges, start, pose, parameters):
    """Return the beam of the next echo that binds, if both it and that at the start are beside the blind zone, else -1.

    So what is between them may be nearer than beams tell. `echoes` are `Echoes`, ranges (beams,) [m]; `start` are the
    beam of an echo and the step, 1 or -1, in which to look.
    """
    beam, step = start
    if not is_beside_blind_zone(ranges[beam], echoes.variance[beam], pose, parameters):
        return -1
    for away in range(1, len(ranges) // 2):
        other = next_beam(beam, step * away, parameters)
        if other < 0 or parameters.blocked[other]:
            break
        if echoes.binds[other]:
            return other if is_beside_blind_zone(ranges[other], echoes.variance[other], pose, parameters) else -1
    return -1


@kernel
def _all_round(k, beams):
    """Return k modulo the number of beams; hardly any k needs the division, which takes as long as ten additions."""
    return k if 0 <= k < beams else k % beams


@kernel
def nearest_from(k, x, y, directions, parameters):
    """Return the beam nearest to a direction, from beam k on: beams of a scan that takes time are apart unevenly."""
    for _ in range(len(directions)):
        best, most = k, directions[k, 0] * x + directions[k, 1] * y
        for step in (-1, 1):
            other = next_beam(k, step, parameters)
            if other >= 0 and directions[other, 0] * x + directions[other, 1] * y > most:
                best, most = other, directions[other, 0] * x + directions[other, 1] * y
        if best == k:
            break
        k = best
    return k
