"""The edge of what a scan shows to be free; what lies behind it is unknown and binds under `estimator.unknown: closed`.

A beam shows its way to be free up to its echo, and without one up to the range limit, or under `strict` nothing. What
lies between two beams is taken to be free up to the chord between their ends; so is what a team-mate hides, a lone echo
that nobody has confirmed yet, and under `strict` the silent beams between two echoes. Where no beam within `WIDEST`
tells anything, on blind sides, what scans before have shown stays known (`occupancy_grid`). Where team-mates alone may
leave a side blind, a robot knows of no more there than the disc that it needs to turn on the spot. The edge is told by
places, no two neighbours farther apart than `least_joining`, so that no robot passes between them; at echoes there are
points already.

Silent beams between two echoes at the shortest range end at the chord between these, under `free` as well: what is
there may be nearer than beams tell, as is the middle of a wall beside which a robot starts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import echo_across_blind_zone, next_beam
from pbrg_mj.perception.points.occupancy_grid import free_range, move_grid, update_grid
from pbrg_mj.perception.scan.line_fit import wrapped

WIDEST = math.radians(120.0)  # between two beams whose ends a chord may join: it passes at half their range or more
ARC = math.radians(10.0)  # between corners on blind sides
MOST_BLIND = 40  # corners of a blind side; there are no more than three


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
def edge_of_free(echoes, beams, pose, grid, parameters):
    """Return the `Edge` of a scan with `echoes` (see `detect`) and its `SeenBeams`; none where nothing closes.

    `grid`, the robot's `OccupancyGrid`, is brought to what is known after the scan.
    """
    chords, angles = _chords((echoes, beams), pose, parameters), _angles(beams.directions, pose.heading, parameters)
    if not parameters.closed_beyond:
        return _edge_at_chords(chords, angles, pose)
    reach = _reach(echoes, beams.ranges, chords, parameters)
    if len(grid.free) > 0:
        move_grid(grid, pose, parameters)
        seen = np.flatnonzero(reach)
        if len(seen) > 1:
            update_grid(grid, (angles[seen], reach[seen]), WIDEST, pose, parameters)
    outline, corners = _outline(reach, echoes.binds, angles, (grid, pose), parameters)
    places = 0
    for i in range(corners - 1):
        places += _parts(outline, i, parameters.least_joining)
    edge, count = _empty_edge(places), 0
    for i in range(corners - 1):
        parts = _parts(outline, i, parameters.least_joining)
        for part in range(1 if outline.echo[i] else 0, parts):
            share = part / parts
            x = outline.x[i] + share * (outline.x[i + 1] - outline.x[i])
            y = outline.y[i] + share * (outline.y[i + 1] - outline.y[i])
            count = _append_place(edge, count, (x, y), pose)
    return Edge(edge.x[:count], edge.y[:count], edge.pose_std[:count])


@kernel
def _edge_at_chords(chords, angles, pose):
    """Return the `Edge` of chords (beams,) [m] alone, those of `_chords`; angles (beams,) [rad] are in the world."""
    edge, count = _empty_edge(np.count_nonzero(chords > 0.0)), 0
    for k in range(len(chords)):
        if chords[k] > 0.0:
            place = chords[k] * math.cos(angles[k]), chords[k] * math.sin(angles[k])
            count = _append_place(edge, count, place, pose)
    return edge


@kernel
def _empty_edge(most):
    """Return an `Edge` with room for so many places."""
    return Edge(np.empty(most), np.empty(most), np.empty(most))


@kernel
def _append_place(edge, count, place, pose):
    """Add a place (2,) [m], from the robot's centre in the world's axes; return the new count."""
    x, y = place
    edge.x[count], edge.y[count] = pose.x + x, pose.y + y
    edge.pose_std[count] = math.sqrt(pose.position_var + (x * x + y * y) * pose.heading_var)
    return count + 1


@kernel
def _chords(seen, pose, parameters):
    """Return how far away on silent beams (beams,) the chord is between two echoes beside the blind zone [m], else 0.

    `seen` are `Echoes` and `SeenBeams`.
    """
    echoes, (ranges, directions) = seen
    chords = np.zeros(len(ranges))
    for a in range(len(ranges)):
        if not echoes.binds[a]:
            continue
        b = echo_across_blind_zone(echoes, ranges, (a, 1), pose, parameters)
        if b < 0 or directions[a, 0] * directions[b, 0] + directions[a, 1] * directions[b, 1] < math.cos(WIDEST):
            continue
        x, y = ranges[a] * directions[a, 0], ranges[a] * directions[a, 1]
        along_x, along_y = ranges[b] * directions[b, 0] - x, ranges[b] * directions[b, 1] - y
        k = next_beam(a, 1, parameters)
        while k != b:
            if math.isnan(ranges[k]):
                chords[k] = (x * along_y - y * along_x) / (directions[k, 0] * along_y - directions[k, 1] * along_x)
            k = next_beam(k, 1, parameters)
    return chords


@kernel
def _reach(echoes, ranges, chords, parameters):
    """Return how far each beam shows its way to be free [m]; 0 where it tells nothing.

    ranges (beams,) and chords (beams,), those of `_chords`, are in metres.
    """
    reach = np.zeros(len(ranges))
    for k in range(len(ranges)):
        if echoes.binds[k]:
            reach[k] = ranges[k]
        elif chords[k] > 0.0:
            reach[k] = chords[k]
        elif math.isnan(ranges[k]) and parameters.silence_is_free and not parameters.blocked[k]:
            reach[k] = parameters.range_max
    return reach


@kernel
def _outline(reach, binds, angles, known, parameters):
    """Return the `Outline` and how many corners it has.

    reach (beams,) [m] is that of `_reach`, binds (beams,) whether there is an echo that does, angles (beams,) [rad] are
    in the world; `known` are the robot's `OccupancyGrid` and its pose.
    """
    beams = len(reach)
    most = beams + 1 + 3 * MOST_BLIND
    outline = Outline(np.empty(most), np.empty(most), np.zeros(most, np.bool_))
    first, last, count = -1, -1, 0
    for k in range(beams):
        if reach[k] > 0.0:
            if first < 0:
                first = k
            else:
                count = _blind_side(outline, count, (angles[last], angles[k]), known, parameters)
            count = _corner(outline, count, (angles[k], reach[k]), binds[k])
            last = k
    if first < 0:
        count = _blind_side(outline, count, (0.0, 2.0 * math.pi), known, parameters)
    else:
        count = _blind_side(outline, count, (angles[last], angles[first] + 2.0 * math.pi), known, parameters)
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
def _blind_side(outline, count, sector, known, parameters):
    """Add the corners of what is known to be free between the directions of a sector (2,) [rad] if they are far apart.

    `known` are the robot's `OccupancyGrid` and its pose.
    """
    if sector[1] - sector[0] <= WIDEST:
        return count
    grid, pose = known
    steps = math.ceil((sector[1] - sector[0]) / ARC)
    for step in range(steps + 1):
        angle = sector[0] + (sector[1] - sector[0]) * step / steps
        way = free_range(grid, angle, pose, parameters) if len(grid.free) > 0 else parameters.blind_radius
        count = _corner(outline, count, (angle, way), False)
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
def _parts(outline, i, longest):
    """Return into how many parts the side from corner i on is cut, none longer than `longest` [m]."""
    x, y = outline.x[i + 1] - outline.x[i], outline.y[i + 1] - outline.y[i]
    return max(math.ceil(math.sqrt(x * x + y * y) / longest), 1)
