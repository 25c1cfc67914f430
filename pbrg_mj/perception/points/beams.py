"""The beams of a scan, and which of them looks in a direction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel


class SeenBeams(NamedTuple):
    """One scan of one robot in its body frame as it was at the end of the scan."""

    ranges: np.ndarray  # (beams,) [m]
    directions: np.ndarray  # (beams, 2) unit vectors


@kernel
def layout(parameters):
    """Return what tells a beam's direction, without the rest: handing over all parameters takes longer than its use."""
    return parameters.first, parameters.gap, len(parameters.directions), parameters.closed


@kernel
def nearest_beam(x, y, layout):
    """Return the beam nearest to the direction of (x, y) in the body frame, -1 for none within half a gap.

    `layout` is that of `layout`: first [rad], gap [rad], how many beams, closed. For beams that are apart evenly; where
    a scan takes time, `nearest_from` goes on from there.
    """
    first, gap, beams, closed = layout
    turns = (math.atan2(y, x) - first) / (2.0 * math.pi)
    ahead = (turns - math.floor(turns)) * 2.0 * math.pi / gap
    beam = math.floor(ahead + 0.5)
    if closed:
        beam = _all_round(beam, beams)
    elif beam >= beams:
        beam = 0 if 2.0 * math.pi / gap - ahead < 0.5 else -1
    return beam


@kernel
def beams_beside(x, y, heading, directions, parameters):
    """Return the beams on either side of the direction (x, y) for a robot that heads [rad], -1 where there are none."""
    turns = (math.atan2(y, x) - heading - parameters.first) / (2.0 * math.pi)
    beams = len(parameters.directions)
    a = math.floor((turns - math.floor(turns)) * 2.0 * math.pi / parameters.gap)
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
def next_beam(k, step, parameters):
    """Return the beam so many after beam k, -1 where beams do not go all the way round."""
    beams, other = len(parameters.directions), k + step
    if parameters.closed:
        return _all_round(other, beams)
    return other if 0 <= other < beams else -1


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
