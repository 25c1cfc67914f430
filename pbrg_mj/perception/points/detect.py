"""One scan to points in the world, without team-mates, and without what a single outlier may be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.memory import place_for
from pbrg_mj.perception.points.parameters import JOINING, LEAST_JOINING

MOST_LOST = 1  # beams without an echo between two of one thing


class Echoes(NamedTuple):
    """One scan in the world, an entry a beam."""

    heard: np.ndarray  # (beams,) bool: an echo of neither the robot itself nor a team-mate
    x: np.ndarray  # (beams,) [m]
    y: np.ndarray  # (beams,) [m]
    variance: np.ndarray  # (beams,) of the range [m^2]
    pose_std: np.ndarray  # (beams,) [m]
    binds: np.ndarray  # (beams,) bool: heard, and no outlier


@kernel
def add_scan(points, scan, ranges, pose, mates, own, parameters):
    """Add the echoes of a scan, `ranges` (beams,) [m], to the memory `points`, and return them.

    `mates` (n, 2) [m] are the places of all robots' bodies and `own` this robot's number: echoes within the body's
    radius and three standard deviations of a team-mate are the team-mate's. An echo with a neighbour, nearer than
    `JOINING` gaps between beams or `LEAST_JOINING`, binds at once; a lone one when it lies where one was before.
    """
    echoes = _echoes(ranges, pose, mates, own, parameters)
    place = -1
    for k in range(len(ranges)):
        if not echoes.heard[k]:
            continue
        std = math.sqrt(echoes.variance[k])
        joins = _neighbour(echoes, ranges, k, -1, parameters), _neighbour(echoes, ranges, k, 1, parameters)
        echoes.binds[k] = max(joins[0], joins[1]) >= 0 or _confirmed(
            points, scan, echoes.x[k], echoes.y[k], std + echoes.pose_std[k], parameters
        )
        place = place_for(points, place + 1)
        point = points[place]
        point["x"], point["y"], point["std"], point["pose_std"] = echoes.x[k], echoes.y[k], std, echoes.pose_std[k]
        point["time"], point["scan"] = pose.time, scan
        point["live"], point["passed"], point["binds"] = True, 0, echoes.binds[k]
        point["bulge"] = 0.0 if _on_a_line(echoes, k, joins) else 0.5 * parameters.gap * ranges[k]
    return echoes


@kernel
def _echoes(ranges, pose, mates, own, parameters):
    """Return where the echoes of a scan are in the world, and how well that is known."""
    beams = len(ranges)
    x, y, variance, pose_std = np.empty(beams), np.empty(beams), np.empty(beams), np.empty(beams)
    echoes = Echoes(np.zeros(beams, np.bool_), x, y, variance, pose_std, np.zeros(beams, np.bool_))
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    for k in range(beams):
        r = ranges[k]
        if parameters.blocked[k] or math.isnan(r):
            continue
        dx, dy = parameters.directions[k, 0], parameters.directions[k, 1]
        x[k], y[k] = pose.x + r * (cos * dx - sin * dy), pose.y + r * (sin * dx + cos * dy)
        variance[k] = parameters.range_std**2 + (parameters.noise_ratio * r) ** 2
        pose_std[k] = math.sqrt(pose.position_var + r * r * pose.heading_var)
        reach = parameters.body_radius + 3.0 * (math.sqrt(variance[k]) + pose_std[k])
        echoes.heard[k] = not _at_a_mate(x[k], y[k], reach, mates, own)
    return echoes


@kernel
def _at_a_mate(x, y, reach, mates, own):
    found = False
    for j in range(len(mates)):
        found = found or (j != own and (x - mates[j, 0]) ** 2 + (y - mates[j, 1]) ** 2 < reach * reach)
    return found


@kernel
def _neighbour(echoes, ranges, k, step, parameters):
    """Return the next echo's beam in a direction if it is of the same thing as that of beam k, else -1."""
    beams = len(ranges)
    for lost in range(1, 2 + MOST_LOST):
        other = k + step * lost
        if parameters.closed:
            other %= beams
        elif other < 0 or other >= beams:
            return -1
        if other != k and echoes.heard[other]:
            x, y = echoes.x[k] - echoes.x[other], echoes.y[k] - echoes.y[other]
            limit = max(JOINING * lost * parameters.gap * max(ranges[k], ranges[other]), LEAST_JOINING)
            limit += 3.0 * math.sqrt(echoes.variance[k] + echoes.variance[other])
            return other if x * x + y * y <= limit * limit else -1
    return -1


@kernel
def _on_a_line(echoes, k, joins):
    """Tell whether an echo lies on the line through both neighbours.

    Within four standard deviations: of the 400 echoes in a memory none is off the line by chance.
    """
    before, after = joins
    if before < 0 or after < 0 or before == after:
        return False
    x, y = echoes.x[after] - echoes.x[before], echoes.y[after] - echoes.y[before]
    across = (echoes.x[k] - echoes.x[before]) * y - (echoes.y[k] - echoes.y[before]) * x
    variance = echoes.variance[k] + 0.25 * (echoes.variance[before] + echoes.variance[after])
    return across * across <= 16.0 * variance * (x * x + y * y)


@kernel
def _confirmed(points, scan, x, y, std, parameters):
    """Tell whether a recent scan had an echo at the same place; then that one binds, too."""
    found = False
    for i in range(len(points)):
        other = points[i]
        if other["live"] and 0 < scan - other["scan"] <= parameters.recent:
            near = 3.0 * (std + other["std"] + other["pose_std"]) + 0.02
            if (x - other["x"]) ** 2 + (y - other["y"]) ** 2 <= near * near:
                other["binds"] = True
                found = True
    return found
