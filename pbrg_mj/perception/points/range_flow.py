"""Range flow: how fast what echoes moves along directions in which a scan, compared with an older one, tells it.

Two echoes that were on either side of an echo's direction span a line; how far the new echo lies off that line is how
far the face has moved along its normal, the normal flow (Horn and Schunck, Artificial Intelligence 17, 1981; in scan
matching the point-to-line metric of Censi, ICRA 2008). Of beams that are close together the noise of two ranges turns
the line, so it goes on to echoes farther apart (older_line.py). What is left of that turn is in the variance: a thing
that slides along its face seems to move along a normal that is turned. A wall along which a robot drives has no flow
along its normal, whatever comes into view, so it stays at rest. Along itself a face is seen to move at its free ends,
beside which beams pass by: the flow there is across the beam, along which an end is known to half a gap between beams.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import are_across_scan_start, is_beside_blind_zone, next_beam
from pbrg_mj.perception.points.normal_flow import FASTEST, along_normal, is_confirmed
from pbrg_mj.perception.points.past_scan import LONGEST, directions_of

NEAR = 1.5  # [m] farther things have time to come nearer
LEFT, RIGHT = 1, 2  # sides of a face, as its robot sees it
BEYOND = 1.0 + 1e-6  # times the distance of a line: a beam goes past it, and not for the rounding of exact ranges


class RangeFlow(NamedTuple):
    """Measured velocities of echoes, each along one direction; functions look at the first entries of each array."""

    x: np.ndarray  # (F,) [m]
    y: np.ndarray  # (F,) [m]
    nx: np.ndarray  # (F,) unit vector along which it tells
    ny: np.ndarray  # (F,)
    speed: np.ndarray  # (F,) along it [m/s]
    variance: np.ndarray  # (F,) of its own [m^2/s^2]
    shared: np.ndarray  # (F,) of the poses, the same for all of a scan [m^2/s^2]
    poses_xx: np.ndarray  # (F,) the covariance of the velocity that poses seem to give to what stands there [m^2/s^2]
    poses_xy: np.ndarray  # (F,)
    poses_yy: np.ndarray  # (F,)
    of_end: np.ndarray  # (F,) bool: of a free end, not along a face's normal


@kernel
def range_flow(seen, told, before, pose, parameters):
    """Return the `RangeFlow` of a scan's near echoes against the oldest one, and how many entries it has.

    `seen` are `Echoes` and ranges (beams,) [m], `told` are ends (beams,), their `free_ends`, and resting
    (beams,), whether they are known to rest, `before` past (lag, beams) of PAST_ECHO, past_poses (lag,) of PAST_POSE
    and order (lag,), that of `scans_by_age`: while it is shorter there is no flow. Flows that the other older scans do
    not confirm are left out.
    """
    (echoes, ranges), (ends, resting), (past, past_poses, order) = seen, told, before
    flows, count = empty_flow(2 * len(ranges)), 0
    if len(order) < len(past_poses):
        return flows, 0
    oldest, oldest_pose = past[order[0]], past_poses[order[0]]
    elapsed, later = pose.time - oldest_pose["time"], (past, past_poses, order[1:], pose.time)
    if not 0.0 < elapsed <= LONGEST:
        return flows, 0
    against = oldest, oldest_pose, directions_of(oldest, parameters)
    for i in range(len(ranges)):
        if not echoes.external[i] or ranges[i] > NEAR or resting[i]:
            continue
        echo, poses = (echoes.x[i], echoes.y[i], echoes.variance[i]), 2.0 * echoes.pose_std[i] ** 2
        found, n, moved, variance = along_normal(echo, against, elapsed, parameters)
        measured = n, moved / elapsed, (variance + poses) / elapsed**2
        if found and is_confirmed(echo, measured, poses, later, parameters):
            count = append_flow(flows, count, (echoes, i), n, (moved, variance), elapsed)
        if ends[i] != 0:
            count = append_end((flows, count), (echoes, i), ends[i], against[:2], pose, parameters)
    return flows, count


@kernel
def empty_flow(most):
    """Return a `RangeFlow` with room for so many entries."""
    x, y, nx, ny = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    measured, poses = (np.empty(most), np.empty(most), np.empty(most)), (np.empty(most), np.empty(most), np.empty(most))
    return RangeFlow(x, y, nx, ny, *measured, *poses, np.zeros(most, np.bool_))


@kernel
def append_flow(flows, count, echo, n, measured, elapsed):
    """Add the flow of an echo, `echo` (echoes, i), along n (2,); return the new count.

    `measured` are how far it has moved and the variance of that [m], [m^2], in the time `elapsed` [s].
    """
    (echoes, i), (moved, variance) = echo, measured
    flows.x[count], flows.y[count], flows.nx[count], flows.ny[count] = echoes.x[i], echoes.y[i], n[0], n[1]
    flows.speed[count], flows.variance[count] = moved / elapsed, (variance + 1e-6) / elapsed**2
    # Both scans have such errors; what the heading adds is across the beam.
    turn, tx, ty = 2.0 * echoes.turn_std[i] ** 2 / elapsed**2, -echoes.uy[i], echoes.ux[i]
    place = 2.0 * echoes.pose_std[i] ** 2 / elapsed**2 - turn
    flows.poses_xx[count], flows.poses_yy[count] = place + turn * tx * tx, place + turn * ty * ty
    flows.poses_xy[count] = turn * tx * ty
    flows.shared[count] = place + turn * (tx * n[0] + ty * n[1]) ** 2
    return count + 1


@kernel
def append_end(measured, echo, sides, before, pose, parameters):
    """Add the flow of an echo's free end, if an older scan has such an end; return how many entries there are.

    `measured` are flows and how many entries they have, `echo` echoes and i, `sides` those on which its face ends, and
    `before` past and past_pose.
    """
    (flows, count), (echoes, i), (past, past_pose) = measured, echo, before
    end, elapsed = ((echoes.x[i], echoes.y[i], echoes.variance[i]), sides), pose.time - past_pose["time"]
    found, n, moved, variance = _along_itself(end, (past, past_pose), pose, elapsed, parameters)
    if not found:
        return count
    flows.of_end[count] = True
    return append_flow(flows, count, (echoes, i), n, (moved, variance), elapsed)


@kernel
def _along_itself(end, before, pose, elapsed, parameters):
    """Return (found, direction, moved, variance): how far the free end of a face has moved across its beam [m], [m^2].

    An end is somewhere between its beam and the next: in the middle, with the variance of a place anywhere there.
    """
    (echo, sides), (past, past_pose) = end, before
    best, found, n, moved, variance = math.inf, False, (0.0, 0.0), 0.0, 0.0
    for side in (LEFT, RIGHT):
        if not sides & side:
            continue
        x, y, ux, uy, half = _end((echo[0], echo[1]), (pose.x, pose.y), side, parameters)
        reach = FASTEST * elapsed + 3.0 * math.sqrt(echo[2])
        for j in range(len(past)):
            if past[j]["external"] and past[j]["ends"] & side:
                then_x, then_y, _, _, then_half = _end(
                    (past[j]["x"], past[j]["y"]), (past_pose["x"], past_pose["y"]), side, parameters
                )
                dx, dy = x - then_x, y - then_y
                squared = dx * dx + dy * dy
                if squared < best and squared <= (reach + half + then_half) ** 2:
                    best, found, n, moved = squared, True, (ux, uy), dx * ux + dy * uy
                    variance = (half * half + then_half * then_half) / 3.0
    return found, n, moved, variance


@kernel
def _end(echo, robot, side, parameters):
    """Return the place x, y of a free end [m], the unit vector across its beam, and half the gap there [m].

    echo (x, y) and robot (x, y) are in the world [m].
    """
    dx, dy = echo[0] - robot[0], echo[1] - robot[1]
    distance = math.sqrt(dx * dx + dy * dy)
    ux, uy = -dy / distance, dx / distance
    half = 0.5 * parameters.gap * distance
    away = half if side == LEFT else -half
    return echo[0] + away * ux, echo[1] + away * uy, ux, uy, half


@kernel
def free_ends(echoes, ranges, pose, parameters):
    """Return for each echo (beams,) on which sides its face ends: `LEFT`, `RIGHT`, their sum or 0.

    It ends where the next beam passes by the line of its last three echoes, however slanted that is; a beam without an
    echo, or with what may be an outlier, does if the one after it passes or has none either. It does not end where the
    echo is on the line of those beside it, as far as ranges are known (corner_bound.py). Nor do these tell of ends:

    - cones: not where in their view a thing ends
    - the first beam and the last of a scan that takes time: the robot may have turned meanwhile
    - silent beams beside echoes at the shortest range: the face may go on nearer than beams tell
    """
    ends = np.zeros(len(ranges), np.int64)
    if parameters.half_cone > 0.0:
        return ends
    cos = math.cos(parameters.gap)
    for i in range(len(ranges)):
        if not echoes.external[i] or ranges[i] > NEAR or echoes.protrusion[i] == 0.0:
            continue
        for side, step in ((LEFT, 1), (RIGHT, -1)):
            inner, outer = next_beam(i, -step, parameters), next_beam(i, step, parameters)
            beyond = next_beam(i, 2 * step, parameters)
            if min(inner, outer, beyond) < 0 or not echoes.external[inner] or parameters.blocked[outer]:
                continue
            if echoes.protrusion[inner] > 0.0 or are_across_scan_start(inner, beyond, parameters):
                continue  # no line of three, or of beams that are a gap apart
            near = 2.0 * cos / ranges[i] - 1.0 / ranges[inner]  # 1 / r of a line is a cosine of the angle
            here, there = echoes.variance[i] / ranges[i] ** 4, echoes.variance[inner] / ranges[inner] ** 4
            near -= 3.0 * math.sqrt(4.0 * here + there)
            if near * parameters.range_max <= 1.0:
                continue
            silent = math.isnan(ranges[outer])
            if silent and is_beside_blind_zone(ranges[i], echoes.variance[i], pose, parameters):
                continue
            passes = silent or ranges[outer] * near > BEYOND
            if silent or (echoes.external[outer] and not echoes.binds[outer]):
                passes &= not parameters.blocked[beyond]
                passes &= math.isnan(ranges[beyond]) or ranges[beyond] * near > BEYOND
            if passes:
                ends[i] |= side
    return ends
