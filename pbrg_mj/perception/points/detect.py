"""One scan to points in the world, without team-mates, and without what a single outlier may be."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.memory import RECENT, place_for
from pbrg_mj.perception.points.parameters import JOINING, LEAST_JOINING

MOST_LOST = 1  # beams without an echo between two of one thing


@kernel
def add_scan(points, scan, ranges, pose, mates, own, parameters):
    """Add the echoes of a scan, `ranges` (beams,) [m], to the memory `points`.

    `mates` (n, 2) [m] are the places of all robots' bodies and `own` this robot's number: echoes within the body's
    radius and three standard deviations of a team-mate are the team-mate's. An echo with a neighbour, nearer than
    `JOINING` gaps between beams or `LEAST_JOINING`, binds at once; a lone one when it lies where one was before.
    """
    beams = len(ranges)
    for k in range(beams):
        if not _is_echo(ranges, k, pose, mates, own, parameters):
            continue
        after = _neighbour(ranges, k, 1, pose, mates, own, parameters)
        joined = after >= 0 or _neighbour(ranges, k, -1, pose, mates, own, parameters) >= 0
        x, y = _place(ranges, k, pose, parameters)
        std, pose_std = _stds(ranges[k], pose, parameters)
        confirmed = joined or _confirmed(points, scan, x, y, std + pose_std)
        point = points[place_for(points)]
        point["x"], point["y"], point["next_x"], point["next_y"] = x, y, x, y
        if after >= 0:
            point["next_x"], point["next_y"] = _place(ranges, after, pose, parameters)
        point["std"], point["pose_std"], point["time"], point["scan"] = std, pose_std, pose.time, scan
        point["live"], point["passed"], point["binds"] = 1, 0, 1 if confirmed else 0


@kernel
def _place(ranges, k, pose, parameters):
    """Return where the echo of beam k is in the world [m]."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    dx, dy = parameters.directions[k, 0], parameters.directions[k, 1]
    return pose.x + ranges[k] * (cos * dx - sin * dy), pose.y + ranges[k] * (sin * dx + cos * dy)


@kernel
def _stds(r, pose, parameters):
    """Return the standard deviations of an echo's range and of what the robot's pose adds to its place [m]."""
    noise = parameters.noise_ratio * r
    return math.sqrt(parameters.range_std**2 + noise * noise), math.sqrt(pose.position_var + r * r * pose.heading_var)


@kernel
def _is_echo(ranges, k, pose, mates, own, parameters):
    """Tell whether beam k has met something that is neither its own robot nor a team-mate."""
    if parameters.blocked[k] or math.isnan(ranges[k]):
        return False
    x, y = _place(ranges, k, pose, parameters)
    std, pose_std = _stds(ranges[k], pose, parameters)
    reach = parameters.body_radius + 3.0 * (std + pose_std)
    for j in range(len(mates)):
        if j != own and (x - mates[j, 0]) ** 2 + (y - mates[j, 1]) ** 2 < reach * reach:
            return False
    return True


@kernel
def _neighbour(ranges, k, step, pose, mates, own, parameters):
    """Return the next beam in a direction whose echo is of the same thing as that of beam k, or -1."""
    beams = len(ranges)
    x, y = _place(ranges, k, pose, parameters)
    for lost in range(1, 2 + MOST_LOST):
        other = k + step * lost
        if parameters.closed:
            other %= beams
        elif other < 0 or other >= beams:
            return -1
        if other != k and _is_echo(ranges, other, pose, mates, own, parameters):
            ox, oy = _place(ranges, other, pose, parameters)
            variance = 2.0 * parameters.range_std**2 + parameters.noise_ratio**2 * (ranges[k] ** 2 + ranges[other] ** 2)
            limit = max(JOINING * lost * parameters.gap * max(ranges[k], ranges[other]), LEAST_JOINING)
            limit += 3.0 * math.sqrt(variance)
            return other if (x - ox) ** 2 + (y - oy) ** 2 <= limit * limit else -1
    return -1


@kernel
def _confirmed(points, scan, x, y, std):
    """Tell whether an earlier scan had an echo at the same place; then that one binds, too."""
    found = False
    for i in range(len(points)):
        other = points[i]
        if other["live"] == 1 and 0 < scan - other["scan"] <= RECENT:
            near = 3.0 * (std + other["std"] + other["pose_std"]) + 0.02
            if (x - other["x"]) ** 2 + (y - other["y"]) ** 2 <= near * near:
                other["binds"] = 1
                found = True
    return found
