"""Which echoes are team-mates': those within their radius of the places that the camera tells."""

from __future__ import annotations

import math
from typing import NamedTuple

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.points import VARIANCE, R, X, Y

RANGE_SIGMAS = 3.0  # standard deviations: a lone echo beyond binds only if another one confirms it
PLACE_SIGMAS = 4.5  # the places are wrong by the same for all echoes of a scan: one scan in 10^5
TILTED = 1e-3  # [m] that a body which tilts, as it drives off and brakes, is wider than its radius


class TeamMateModel(NamedTuple):
    """What beams see of a team-mate."""

    body_radius: float  # [m]; 0: places of team-mates are not known
    half_cone: float  # half the width of a beam's view [rad]; 0: a ray


@kernel
def gating_radius(body_radius, distance, variance, pose):
    """Return how far from a team-mate's place an echo may be [m]: `distance` off, its variance [m^2], seen at a pose.

    The camera knows both robots' places equally well.
    """
    places_std = math.sqrt(2.0 * pose.position_var + distance**2 * pose.heading_var)
    return body_radius + max(RANGE_SIGMAS * math.sqrt(variance) + PLACE_SIGMAS * places_std, TILTED)


@kernel
def is_team_mate(echo, start, radius, team, half_cone):
    """Tell whether an echo of the beam that began at `start` may be within `radius` [m] of another robot's place.

    All in the world [m]: `echo` (x, y), `start` (2,); `team` are the robots' places (n, 2 or more) and this robot's own
    number.
    """
    (x, y), (places, own) = echo, team
    found = False
    for j in range(len(places)):
        if j != own and not found:
            if half_cone > 0.0:
                dx, dy = places[j, 0] - start[0], places[j, 1] - start[1]
                squared = distance_from_arc(dx, dy, (x - start[0], y - start[1]), half_cone)
            else:
                squared = (x - places[j, 0]) ** 2 + (y - places[j, 1]) ** 2
            found = squared < radius * radius
    return found


@kernel
def distance_from_arc(x, y, middle, half_cone):
    """Return the squared distance [m^2] of a place x, y from the arc on which the echo of a cone may be.

    All is seen from where the beam began; `middle` (x, y) [m] is that of the arc.
    """
    radius = math.sqrt(middle[0] ** 2 + middle[1] ** 2)
    if radius == 0.0:
        return x * x + y * y
    along = (x * middle[0] + y * middle[1]) / radius
    across = abs(x * middle[1] - y * middle[0]) / radius
    if math.atan2(across, along) <= half_cone:
        return (math.sqrt(x * x + y * y) - radius) ** 2
    end = radius * math.cos(half_cone), radius * math.sin(half_cone)
    return (along - end[0]) ** 2 + (across - end[1]) ** 2


@kernel
def without_team_mates(lines, count, work, pose, team, params):
    """Drop lines that team-mates alone may make; return how many of the `count` of `lines` are left, in their order.

    In `work.ranking` as well.

    A line stays that would have points enough without those of team-mates: `team` (bodies, own, model) are the places
    of robots when a beam was taken (beams or 1, n, 2) [m], this robot's number and the TeamMateModel, `work` the
    LineWorkspace of the scan.
    """
    if team[2].body_radius == 0.0:
        return count
    left = 0
    for i in range(count):
        if _has_points_enough(work, work.ranking[i], pose, team, params):
            if left < i:
                _move_line(lines, i, left)
                work.ranking[left] = work.ranking[i]
            left += 1
    return left


@kernel
def _has_points_enough(work, line, pose, team, params):
    """Tell whether a line has points enough without those of team-mates.

    `team` is bodies (beams or 1, n, 2), own and model as above.
    """
    bodies, own, model = team
    cos, sin, count = math.cos(pose.heading), math.sin(pose.heading), 0
    for b in range(len(work.owner)):
        if work.owner[b] == line:
            point = work.points[b]
            echo = pose.x + cos * point[X] - sin * point[Y], pose.y + sin * point[X] + cos * point[Y]
            radius = gating_radius(model.body_radius, point[R], point[VARIANCE], pose)
            places = bodies[b if len(bodies) > 1 else 0]
            if not is_team_mate(echo, places[own], radius, (places, own), model.half_cone):
                count += 1
                if count >= params.min_points:
                    return True
    return False


@kernel
def _move_line(lines, i, k):
    """Write line i of a LineBuffer over line k."""
    lines.angle[k], lines.offset[k] = lines.angle[i], lines.offset[i]
    for row in range(2):
        for column in range(2):
            lines.covariance[k, row, column] = lines.covariance[i, row, column]
            lines.error_covariance[k, row, column] = lines.error_covariance[i, row, column]
    lines.low[k], lines.high[k] = lines.low[i], lines.high[i]
    lines.free_low[k], lines.free_high[k] = lines.free_low[i], lines.free_high[i]
