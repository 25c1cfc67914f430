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
from pbrg_mj.perception.points.beams import beams_beside, next_beam
from pbrg_mj.perception.points.older_line import long_line, may_share_face

PAST_ECHO = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("range", "f8"),
        ("variance", "f8"),
        ("off_line", "f8"),
        ("dx", "f8"),
        ("dy", "f8"),
        ("ends", "i8"),
        ("external", "?"),
    ]
)
"""An echo of an older scan: place, range [m], the range's variance [m^2], how far it may lie off its face [m]
(anywhere up to there: a variance of a twelfth of its square), direction of its beam in the body frame, `free_ends`."""
PAST_POSE = np.dtype([("x", "f8"), ("y", "f8"), ("heading", "f8"), ("time", "f8"), ("known", "?")])
"""Where the robot was then [m], [rad], when [s], and whether there is such a scan."""

NEAR = 1.5  # [m] farther things have time to come nearer
FASTEST = 0.7  # [m/s] more is no motion, but another thing
LONGEST = 1.0  # [s] between two scans
ANY_SPEED = 0.3  # [m/s] standard deviation of the velocity of what is seen first
LEFT, RIGHT = 1, 2  # sides of a face, as its robot sees it
BEYOND = 1.0 + 1e-6  # times the distance of a line: a beam goes past it, and not for the rounding of exact ranges
SLANTED = 0.5  # cosine between a face's normal and its beam below which normal flow tells little


class RangeFlow(NamedTuple):
    """Measured velocities of echoes, each along one direction; functions look at the first entries of each array."""

    x: np.ndarray  # (F,) [m]
    y: np.ndarray  # (F,) [m]
    nx: np.ndarray  # (F,) unit vector along which it tells
    ny: np.ndarray  # (F,)
    speed: np.ndarray  # (F,) along it [m/s]
    variance: np.ndarray  # (F,) of its own [m^2/s^2]
    shared: np.ndarray  # (F,) of the poses, the same for all of a scan [m^2/s^2]
    of_end: np.ndarray  # (F,) bool: of a free end, not along a face's normal


@kernel
def range_flow(seen, told, before, pose, parameters):
    """Return the `RangeFlow` of a scan's near echoes against an older one, and how many entries it has.

    `seen` are `Echoes` and ranges (beams,) [m], `told` are ends (beams,), their `free_ends`, and resting
    (beams,), whether they are known to rest, `before` past (beams,) of PAST_ECHO and past_pose, a PAST_POSE record.
    """
    (echoes, ranges), (ends, resting), (past, past_pose) = seen, told, before
    flows, elapsed = empty_flow(2 * len(ranges)), pose.time - past_pose["time"]
    if not past_pose["known"] or not 0.0 < elapsed <= LONGEST:
        return flows, 0
    count, directions = 0, directions_of(past, parameters)
    for i in range(len(ranges)):
        if not echoes.external[i] or ranges[i] > NEAR or resting[i]:
            continue
        echo = echoes.x[i], echoes.y[i], echoes.variance[i]
        found, n, moved, variance = along_normal(echo, (past, past_pose, directions), elapsed, parameters)
        if found:
            count = append_flow(flows, count, (echoes, i), n, (moved, variance), elapsed)
        if ends[i] != 0:
            count = append_end((flows, count), (echoes, i), ends[i], (past, past_pose), pose, parameters)
    return flows, count


@kernel
def empty_flow(most):
    """Return a `RangeFlow` with room for so many entries."""
    x, y, nx, ny = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    return RangeFlow(x, y, nx, ny, np.empty(most), np.empty(most), np.empty(most), np.zeros(most, np.bool_))


@kernel
def append_flow(flows, count, echo, n, measured, elapsed):
    """Add the flow of an echo, `echo` (echoes, i), along n (2,); return the new count.

    `measured` are how far it has moved and the variance of that [m], [m^2], in the time `elapsed` [s].
    """
    (echoes, i), (moved, variance) = echo, measured
    flows.x[count], flows.y[count], flows.nx[count], flows.ny[count] = echoes.x[i], echoes.y[i], n[0], n[1]
    flows.speed[count], flows.variance[count] = moved / elapsed, (variance + 1e-6) / elapsed**2
    flows.shared[count] = 2.0 * echoes.pose_std[i] ** 2 / elapsed**2
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
def along_normal(echo, before, elapsed, parameters):
    """Return (found, normal, moved, variance): how far an echo lies off the line of an older scan [m], [m^2].

    `echo` is (ex, ey, echo_variance), `before` the scan's past, past_pose and directions.
    """
    (past, past_pose, directions), (ex, ey, echo_variance) = before, echo
    nothing = False, (0.0, 0.0), 0.0, 0.0
    dx, dy = ex - past_pose["x"], ey - past_pose["y"]
    a, b = beams_beside(dx, dy, past_pose["heading"], directions, parameters)
    if b < 0 or not may_share_face(past, a, b, parameters):
        return nothing
    off_line = max(past[a]["off_line"], past[b]["off_line"])
    a, b, bent = long_line(past, a, b, parameters)
    along_x, along_y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
    length, noise = math.sqrt(along_x * along_x + along_y * along_y), past[a]["variance"] + past[b]["variance"]
    if length == 0.0:
        return nothing
    ux, uy = -along_y / length, along_x / length
    if ux * dx + uy * dy > 0.0:
        ux, uy = -ux, -uy
    moved = (ex - past[a]["x"]) * ux + (ey - past[a]["y"]) * uy
    slanted = -(ux * dx + uy * dy) < SLANTED * math.sqrt(dx * dx + dy * dy)
    if slanted or abs(moved) > FASTEST * elapsed + 3.0 * math.sqrt(echo_variance):
        return nothing
    share = ((ex - past[a]["x"]) * along_x + (ey - past[a]["y"]) * along_y) / length**2
    share = min(max(share, 0.0), 1.0)
    variance = echo_variance + (1.0 - share) ** 2 * past[a]["variance"] + share**2 * past[b]["variance"]
    turned = noise * (ANY_SPEED * elapsed / length) ** 2
    return True, (ux, uy), moved, variance + off_line**2 / 12.0 + bent**2 + turned


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
def free_ends(echoes, ranges, parameters):
    """Return for each echo (beams,) on which sides its face ends: `LEFT`, `RIGHT`, their sum or 0.

    It ends where the next beam passes by the line of its last three echoes, however slanted that is; a beam without an
    echo does if the one after it passes or has none either. Cones do not tell where in their view a thing ends.
    """
    ends = np.zeros(len(ranges), np.int64)
    if parameters.half_cone > 0.0:
        return ends
    cos = math.cos(parameters.gap)
    for i in range(len(ranges)):
        if not echoes.external[i] or ranges[i] > NEAR:
            continue
        for side, step in ((LEFT, 1), (RIGHT, -1)):
            inner, outer = next_beam(i, -step, parameters), next_beam(i, step, parameters)
            beyond = next_beam(i, 2 * step, parameters)
            if min(inner, outer, beyond) < 0 or not echoes.external[inner] or parameters.blocked[outer]:
                continue
            if echoes.protrusion[inner] > 0.0:
                continue  # no line of three
            near = 2.0 * cos / ranges[i] - 1.0 / ranges[inner]  # 1 / r of a line is a cosine of the angle
            here, there = echoes.variance[i] / ranges[i] ** 4, echoes.variance[inner] / ranges[inner] ** 4
            near -= 3.0 * math.sqrt(4.0 * here + there)
            if near * parameters.range_max <= 1.0:
                continue
            passes = ranges[outer] * near > BEYOND
            if math.isnan(ranges[outer]) and not parameters.blocked[beyond]:
                passes = math.isnan(ranges[beyond]) or ranges[beyond] * near > BEYOND
            if passes:
                ends[i] |= side
    return ends


@kernel
def directions_of(past, parameters):
    """Return the directions (beams, 2) of an older scan's beams; those of all scans where a scan takes no time."""
    if not parameters.scan_time > 0.0:
        return parameters.directions
    directions = np.empty((len(past), 2))
    for k in range(len(past)):
        directions[k, 0], directions[k, 1] = past[k]["dx"], past[k]["dy"]
    return directions


@kernel
def store_scan(past, past_pose, seen, ends, pose):
    """Write a scan over the oldest one, past (beams,) of PAST_ECHO and past_pose (1,) of PAST_POSE.

    `seen` are its Echoes and SeenBeams, `ends` (beams,) those of `free_ends`.
    """
    echoes, beams = seen
    for i in range(len(past)):
        past[i]["x"], past[i]["y"], past[i]["external"] = echoes.x[i], echoes.y[i], echoes.external[i]
        past[i]["dx"], past[i]["dy"] = beams.directions[i, 0], beams.directions[i, 1]
        past[i]["ends"] = ends[i]
        past[i]["range"], past[i]["variance"], past[i]["off_line"] = (
            beams.ranges[i],
            echoes.variance[i],
            echoes.protrusion[i],
        )
    past_pose[0]["x"], past_pose[0]["y"], past_pose[0]["heading"] = pose.x, pose.y, pose.heading
    past_pose[0]["time"], past_pose[0]["known"] = pose.time, True
