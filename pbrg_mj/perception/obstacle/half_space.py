"""One half-space for each obstacle: the one with the widest gap between it and the robots it binds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.obstacle.outline import FACE, HIDDEN, OTHER, crossing, outline
from pbrg_mj.perception.obstacle.polygons import compiled_hull, gap
from pbrg_mj.perception.track.extent import track_ends
from pbrg_mj.perception.track.records import error_covariance


class BoundRobots(NamedTuple):
    """Where the robots that a half-space binds are thought to be, seen from the robot's anchor."""

    team: np.ndarray  # (k, 2) corners of the hull of the robots bound, counter-clockwise [m]
    hand: np.ndarray  # (1, 2) the own hand point [m]
    position_var: float  # variance of a point's place, constant part [m^2]
    heading_var: float  # and part per square metre of distance [rad^2]


@kernel
def half_space(tracks, root, links, robots, params):
    """Return gx, gy, h, distance of the half-space g . (q - anchor) <= h for the obstacle whose first face is `root`.

    The distance [m] is that of the robots bound from the obstacle. When no half-space parts them, the own hand point
    alone is kept off it; when that is inside as well, the face that is least crossed is the answer.
    """
    corners = outline(tracks, root, links, robots.hand[0], params)
    points, _, sides = corners
    order = compiled_hull(points)
    solid = points[order]
    track = tracks[root]
    gx, gy, width, i, j = gap(robots.team, solid)
    track["own_only"] = 1 if width < (params.team_gap if track["own_only"] else 0.0) else 0
    bound = robots.hand if track["own_only"] else robots.team
    if track["own_only"]:
        gx, gy, width, i, j = gap(robots.hand, solid)
    if width < 0:
        return _least_crossed(tracks, root, links, robots, params)
    a, b = order[i], order[j]
    face = _common_face(sides, a, b) if i != j else -1
    if face >= 0:
        gx, gy, h = _face_row(tracks[face], bound, params)
        return gx, gy, h, width
    var = _corner_var(tracks, corners, a, (gx, gy), (robots, params))
    var = max(var, _corner_var(tracks, corners, b, (gx, gy), (robots, params)), 0.0)
    h = gx * points[a, 0] + gy * points[a, 1]
    return gx, gy, h - params.clearance - params.sigmas * math.sqrt(var), width


@kernel
def _common_face(sides, a, b):
    """Return the face on which the corners a and b both lie in view, or -1."""
    if sides[a, HIDDEN] or sides[b, HIDDEN]:
        return -1
    if sides[a, FACE] == sides[b, FACE] or sides[a, FACE] == sides[b, OTHER]:
        return sides[a, FACE]
    shared = sides[a, OTHER] == sides[b, FACE] or sides[a, OTHER] == sides[b, OTHER]
    return sides[a, OTHER] if sides[a, OTHER] >= 0 and shared else -1


@kernel
def _face_row(track, bound, params):
    """Return the face's half-space, kept off by what is uncertain where the robots bound are.

    bound (k, 2) [m] are the hull of those, or the own hand point.
    """
    gx, gy = math.cos(track["angle"]), math.sin(track["angle"])
    low, high = track_ends(track)
    var = 0.0
    for k in range(len(bound)):
        s = min(max(bound[k, 1] * gx - bound[k, 0] * gy, low), high)
        var = max(var, _variance(track, s, params))
    return gx, gy, track["offset"] - params.clearance - params.sigmas * math.sqrt(var)


@kernel
def _variance(track, s, params):
    """Return the variance of a face's place along its normal, at coordinate s: offset - angle s."""
    aa, ac, cc = error_covariance(track, params)
    return cc - 2 * s * ac + s * s * aa


@kernel
def _corner_var(tracks, corners, corner, g, known):
    """Return the variance of g . x of one corner x of an outline, g (2,) a unit vector.

    Where two faces meet, n . x = offset of both gives it; an end has the face's variance across and that of any point
    along. What is `known` are the BoundRobots and the TrackParameters.
    """
    (_, along, sides), (robots, params) = corners, known
    s, face, other = along[corner], sides[corner, FACE], sides[corner, OTHER]
    a = tracks[face]
    ax, ay = math.cos(a["angle"]), math.sin(a["angle"])
    va = _variance(a, s, params)
    if other < 0:
        end_var = robots.position_var + robots.heading_var * (s**2 + a["offset"] ** 2)
        return (g[0] * ax + g[1] * ay) ** 2 * va + (g[1] * ax - g[0] * ay) ** 2 * end_var
    b = tracks[other]
    bx, by = math.cos(b["angle"]), math.sin(b["angle"])
    vb = _variance(b, crossing(a, b)[1], params)
    det = ax * by - ay * bx
    return ((g[0] * by - g[1] * bx) / det) ** 2 * va + ((g[1] * ax - g[0] * ay) / det) ** 2 * vb


@kernel
def _least_crossed(tracks, root, links, robots, params):
    """Return the half-space of the face that the own hand point has crossed least: an infeasible row says so."""
    best, face, at = math.inf, root, root
    while at >= 0:
        track = tracks[at]
        depth = robots.hand[0, 0] * math.cos(track["angle"]) + robots.hand[0, 1] * math.sin(track["angle"])
        if depth - track["offset"] < best:
            best, face = depth - track["offset"], at
        at = links[1][at]
        if at == root:
            break
    gx, gy, h = _face_row(tracks[face], robots.hand, params)
    return gx, gy, h, -best
