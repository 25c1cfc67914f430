"""The edge of what a scan shows to be free; what lies behind it is unknown and binds under `estimator.unknown: closed`.

A beam shows its way to be free up to its echo, and without one up to the range limit, or under `strict` nothing. What
lies between two beams is taken to be free up to the chord between their ends; so is what a team-mate hides, a lone echo
that nobody has confirmed yet, and under `strict` the silent beams between two echoes. Where no beam within `WIDEST`
tells anything, on blind sides, a robot knows of no more than the disc that it needs to turn on the spot. The edge is
told by places, no two neighbours farther apart than `LEAST_JOINING`, so that no robot passes between them; at echoes
there are points already.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.parameters import LEAST_JOINING
from pbrg_mj.perception.scan.line_fit import wrapped

WIDEST = math.radians(120.0)  # between two beams whose ends a chord may join: it passes at half their range or more
ARC = math.radians(30.0)  # between corners of the disc on blind sides
MOST_BLIND = 16  # corners of a blind side; there are no more than three


class Edge(NamedTuple):
    """Places on the edge of what is known to be free."""

    x: np.ndarray  # (E,) [m]
    y: np.ndarray  # (E,) [m]
    pose_std: np.ndarray  # (E,) [m]


class Outline(NamedTuple):
    """Corners of the known free space around the robot's centre, counter-clockwise, the last is the first again."""

    x: np.ndarray  # (V,) [m]
    y: np.ndarray  # (V,) [m]
    echo: np.ndarray  # (V,) bool: there is a point already


@kernel
def edge_of_free(echoes, beams, pose, parameters):
    """Return the `Edge` of a scan with `echoes` (see `detect`) and its `SeenBeams`; none where nothing closes."""
    if not parameters.closed_beyond:
        return Edge(np.empty(0), np.empty(0), np.empty(0))
    angles = _angles(beams.directions, pose.heading, parameters)
    reach = _reach(echoes, beams.ranges, parameters)
    outline, corners = _outline(reach, echoes.binds, (pose.heading, angles), parameters)
    places = 0
    for i in range(corners - 1):
        places += _parts(outline, i)
    edge, count = Edge(np.empty(places), np.empty(places), np.empty(places)), 0
    for i in range(corners - 1):
        parts = _parts(outline, i)
        for part in range(1 if outline.echo[i] else 0, parts):
            share = part / parts
            x = outline.x[i] + share * (outline.x[i + 1] - outline.x[i])
            y = outline.y[i] + share * (outline.y[i + 1] - outline.y[i])
            edge.x[count], edge.y[count] = pose.x + x, pose.y + y
            edge.pose_std[count] = math.sqrt(pose.position_var + (x * x + y * y) * pose.heading_var)
            count += 1
    return Edge(edge.x[:count], edge.y[:count], edge.pose_std[:count])


@kernel
def _reach(echoes, ranges, parameters):
    """Return how far each beam shows its way to be free [m]; 0 where it tells nothing."""
    reach = np.zeros(len(ranges))
    for k in range(len(ranges)):
        if echoes.binds[k]:
            reach[k] = ranges[k]
        elif math.isnan(ranges[k]) and parameters.silence_is_free and not parameters.blocked[k]:
            reach[k] = parameters.range_max
    return reach


@kernel
def _outline(reach, binds, directions, parameters):
    """Return the `Outline` and how many corners it has.

    reach (beams,) [m] is that of `_reach`, binds (beams,) whether there is an echo that does; `directions` are the
    robot's heading and angles (beams,) of the beams in the world [rad].
    """
    heading, angles = directions
    beams = len(reach)
    most = beams + 1 + 3 * MOST_BLIND
    outline = Outline(np.empty(most), np.empty(most), np.zeros(most, np.bool_))
    first, last, count = -1, -1, 0
    for k in range(beams):
        if reach[k] > 0.0:
            if first < 0:
                first = k
            else:
                count = _blind_side(outline, count, (angles[last], angles[k]), parameters)
            count = _corner(outline, count, (angles[k], reach[k]), binds[k])
            last = k
    if first < 0:
        count = _disc(outline, 0, (heading, heading + 2.0 * math.pi), parameters.blind_radius)
    else:
        count = _blind_side(outline, count, (angles[last], angles[first] + 2.0 * math.pi), parameters)
    return outline, _close(outline, count)


@kernel
def _angles(directions, heading, parameters):
    """Return the directions of beams in the world (beams,) [rad], ascending but for what a turn's time moves them."""
    angles = np.empty(len(directions))
    for k in range(len(directions)):
        angles[k] = heading + parameters.first + k * parameters.gap
        if parameters.scan_time > 0.0:
            angles[k] += wrapped(math.atan2(directions[k, 1], directions[k, 0]) + heading - angles[k])
    return angles


@kernel
def _blind_side(outline, count, sector, parameters):
    """Add the disc's corners between the two directions of a sector (2,) [rad] if they are far apart."""
    if sector[1] - sector[0] <= WIDEST:
        return count
    return _disc(outline, count, sector, parameters.blind_radius)


@kernel
def _disc(outline, count, sector, radius):
    """Add the corners of a disc of a radius [m] between two directions."""
    steps = math.ceil((sector[1] - sector[0]) / ARC)
    for step in range(steps + 1):
        angle = sector[0] + (sector[1] - sector[0]) * step / steps
        count = _corner(outline, count, (angle, radius), False)
    return count


@kernel
def _corner(outline, count, polar, echo):
    """Add the corner `polar` (angle, radius) [rad], [m]; `echo` tells whether an echo is there."""
    angle, radius = polar
    outline.x[count], outline.y[count], outline.echo[count] = radius * math.cos(angle), radius * math.sin(angle), echo
    return count + 1


@kernel
def _close(outline, count):
    outline.x[count], outline.y[count], outline.echo[count] = outline.x[0], outline.y[0], outline.echo[0]
    return count + 1


@kernel
def _parts(outline, i):
    """Return into how many parts the side from corner i on is cut."""
    x, y = outline.x[i + 1] - outline.x[i], outline.y[i + 1] - outline.y[i]
    return max(math.ceil(math.sqrt(x * x + y * y) / LEAST_JOINING), 1)
