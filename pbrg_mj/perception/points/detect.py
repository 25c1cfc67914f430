"""One scan to points in the world, without team-mates, and without what a single outlier may be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.confirm import confirm_echo, earlier_echoes
from pbrg_mj.perception.points.corner_bound import MOST_LOST, corner_bound, share_corner_bounds
from pbrg_mj.perception.points.memory import free_slot, write_point
from pbrg_mj.perception.points.replaced import delete_replaced
from pbrg_mj.perception.points.unexpected import EXPECTED, UNEXPECTED, unexpected_echoes
from pbrg_mj.perception.scan.team_mates import gating_radius, is_team_mate


class Echoes(NamedTuple):
    """One scan in the world, an entry a beam."""

    external: np.ndarray  # (beams,) bool: an echo of neither the robot itself nor a team-mate
    x: np.ndarray  # (beams,) [m]
    y: np.ndarray  # (beams,) [m]
    variance: np.ndarray  # (beams,) of the range [m^2]
    pose_std: np.ndarray  # (beams,) [m]
    turn_std: np.ndarray  # (beams,) what of that the heading adds, across the beam [m]
    ux: np.ndarray  # (beams,) direction of the beam
    uy: np.ndarray  # (beams,)
    binds: np.ndarray  # (beams,) bool: external, and no outlier
    confirmed_within: np.ndarray  # (beams,) how far off the nearest echo of another scan is that did [m], or inf
    protrusion: np.ndarray  # (beams,) how far a right-angled corner between its beam and the next may stick out [m]
    joined: np.ndarray  # (beams, 2) the beams of the next echoes on its face before and after it, -1: none


@kernel
def add_scan(points, scan, beams, pose, team, before, parameters):
    """Add the echoes of a scan, `SeenBeams`, to the memory `points`, and return them.

    `team` are the places of all robots' bodies, (beams, n, 2) [m] when each beam was taken or (1, n, 2) for all beams,
    and this robot's number. Echoes within the body's radius and three standard deviations of a team-mate are the
    team-mate's; where a beam is a cone, those that may be so near anywhere in it.

    `before` are the past and past_poses of `unexpected_echoes`.

    Echoes in a row, neighbours nearer than `JOINING` gaps between beams or `least_joining`, bind at once if they are
    one more than the earlier echoes at its place that confirm a lone one: two where one does, more where outliers are
    more frequent. What is less binds when earlier echoes at its place make up for it. An echo where the scan before
    saw nothing is a lone one if its neighbours are not.
    """
    echoes = _echoes(beams, pose, team, parameters)
    _write_which_bind(echoes, points, (scan, beams.ranges), before, pose, parameters)
    delete_replaced(points, scan, echoes, pose, parameters)
    place, joined = -1, echoes.joined
    for k in range(len(joined)):
        if not echoes.external[k]:
            continue
        place = free_slot(points, place + 1)
        point = points[place]
        stds = math.sqrt(echoes.variance[k]), echoes.pose_std[k], echoes.turn_std[k]
        write_point(point, (echoes.x[k], echoes.y[k]), (echoes.ux[k], echoes.uy[k]), stds, (pose.time, scan))
        point["binds"], point["confirmed_within"], point["beam"] = echoes.binds[k], echoes.confirmed_within[k], k
        corner = corner_bound(echoes, beams.ranges, k, (joined[k, 0], joined[k, 1]), parameters)
        point["protrusion"], point["slack"] = corner.protrusion, corner.slack
        point["along_x"], point["along_y"] = corner.along_x, corner.along_y
        echoes.protrusion[k] = corner.protrusion
    share_corner_bounds(points, len(joined))
    return echoes


@kernel
def _write_which_bind(echoes, points, scan_and_ranges, before, pose, parameters):
    """Write which echoes bind, and the next echoes on their faces."""
    scan, ranges = scan_and_ranges
    earlier = earlier_echoes(points, scan, parameters.recent, parameters.confirming)
    expected = unexpected_echoes(echoes, before, pose, parameters)
    for k in range(len(ranges)):
        if not echoes.external[k]:
            continue
        joins = _neighbour(echoes, ranges, k, -1, parameters), _neighbour(echoes, ranges, k, 1, parameters)
        echoes.joined[k, 0], echoes.joined[k, 1] = joins
        run = 1 if _is_lone(expected, k, joins) else _run(echoes, ranges, k, joins, parameters)
        asked = (echoes.x[k], echoes.y[k], math.sqrt(echoes.variance[k]), echoes.pose_std[k])
        needed = parameters.confirmations + 1 - run
        if needed > 0:
            echoes.confirmed_within[k] = confirm_echo(points, earlier, (asked, needed), pose, parameters)
        echoes.binds[k] = needed <= 0 or echoes.confirmed_within[k] < math.inf


@kernel
def _echoes(seen, pose, team, parameters):
    """Return where the echoes of a scan are in the world, and how well that is known.

    `seen` is ranges and directions, `team` places (beams or 1, n, 2) and the robot's own number.
    """
    (ranges, directions), (places, own) = seen, team
    beams = len(ranges)
    x, y, variance = np.empty(beams), np.empty(beams), np.empty(beams)
    pose_std, turn_std = np.empty(beams), np.empty(beams)
    external, binds, ux, uy = np.zeros(beams, np.bool_), np.zeros(beams, np.bool_), np.empty(beams), np.empty(beams)
    confirmed_within, protrusion, joined = np.full(beams, np.inf), np.zeros(beams), np.full((beams, 2), -1)
    echoes = Echoes(external, x, y, variance, pose_std, turn_std, ux, uy, binds, confirmed_within, protrusion, joined)
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    for k in range(beams):
        r = ranges[k]
        if parameters.blocked[k] or math.isnan(r):
            continue
        dx, dy = directions[k, 0], directions[k, 1]
        ux[k], uy[k] = cos * dx - sin * dy, sin * dx + cos * dy
        x[k], y[k] = pose.x + r * ux[k], pose.y + r * uy[k]
        variance[k] = parameters.range_std**2 + (parameters.noise_ratio * r) ** 2
        turn_std[k] = r * math.sqrt(pose.heading_var)
        pose_std[k] = math.sqrt(pose.position_var + turn_std[k] ** 2)
        radius = gating_radius(parameters.body_radius, r, variance[k], pose)
        mates, start = places[min(k, len(places) - 1)], (pose.x, pose.y)
        if len(places) > 1:
            start = mates[own, 0], mates[own, 1]
        echoes.external[k] = not is_team_mate((x[k], y[k]), start, radius, (mates, own), parameters.half_cone)
    return echoes


@kernel
def _neighbour(echoes, ranges, k, step, parameters):
    """Return the next echo's beam in a direction if it is of the same thing as that of beam k, else -1."""
    for lost in range(1, 2 + MOST_LOST):
        other = next_beam(k, step * lost, parameters)
        if other < 0:
            return -1
        if other != k and echoes.external[other]:
            x, y = echoes.x[k] - echoes.x[other], echoes.y[k] - echoes.y[other]
            squared = x * x + y * y
            limit = max(min(ranges[k], ranges[other]) * parameters.joining[lost - 1], parameters.least_joining)
            if squared > limit * limit:
                limit += 3.0 * math.sqrt(echoes.variance[k] + echoes.variance[other])
            return other if squared <= limit * limit else -1
    return -1


@kernel
def _is_lone(expected, k, joins):
    """Tell whether echo k is unexpected, and both that it joins, -1 for none, are not: they are of what was there."""
    lone = expected[k] == UNEXPECTED
    for other in joins:
        lone = lone and (other < 0 or expected[other] == EXPECTED)
    return lone


@kernel
def _run(echoes, ranges, k, joins, parameters):
    """Return how many echoes in a row an echo is one of, no more than bind at once.

    `joins` (2,) are the echoes before and after it, -1 for none.
    """
    if parameters.outliers and _stands_alone(echoes, ranges, k, joins, parameters):
        return 1
    count, enough = 1, parameters.confirmations + 1
    for side in range(2):
        other, step = joins[side], 2 * side - 1
        while other >= 0 and count < enough:
            count += 1
            other = _neighbour(echoes, ranges, other, step, parameters) if count < enough else -1
    return count


@kernel
def _stands_alone(echoes, ranges, k, joins, parameters):
    """Tell whether echo k is ahead of all that it joins by more than a face at 60 deg explains.

    `joins` are the beams of its neighbours, -1 for none. Then `least_joining` alone joins them: an outlier before a
    near wall is as likely as a thin thing there.
    """
    for other in joins:
        if other >= 0:
            lost = min((other - k) % len(ranges), (k - other) % len(ranges)) - 1
            steep = ranges[k] * parameters.joining[lost] + 3.0 * math.sqrt(echoes.variance[k] + echoes.variance[other])
            if ranges[other] - ranges[k] <= steep:
                return False
    return True
