"""Normal flow: how far an echo lies off the line of two echoes of an older scan, and whether other scans confirm it.

What has moved by d in the time t has moved by d t'/t since a scan of the time t' ago. What stands, but is measured off
a line that joins two other things, is d off it in every scan. So what surely moves since the oldest scan must have
moved as fast since another one, the next oldest that has a line there.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import beams_beside
from pbrg_mj.perception.points.older_line import is_steady, long_line, may_share_face
from pbrg_mj.perception.points.past_scan import directions_of

FASTEST = 0.7  # [m/s] more is no motion, but another thing
ANY_SPEED = 0.3  # [m/s] standard deviation of the velocity of what is seen first
SLANTED = 0.5  # cosine between a face's normal and its beam below which the line of two echoes tells little
STEEP = 0.15  # and below which a straight face tells nothing, 81 deg
SURE = 4.0  # squared deviations from rest from which on a flow must be confirmed
SAME = 9.0  # squared deviations by which the speeds of two scans may differ
ALIKE = 0.8  # cosine between their normals, 37 deg: noise turns the line of two echoes by as much


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
    least = STEEP if off_line == 0.0 and is_steady(past, a, b) else SLANTED
    slanted = -(ux * dx + uy * dy) < least * math.sqrt(dx * dx + dy * dy)
    if slanted or abs(moved) > FASTEST * elapsed + 3.0 * math.sqrt(echo_variance):
        return nothing
    share = ((ex - past[a]["x"]) * along_x + (ey - past[a]["y"]) * along_y) / length**2
    share = min(max(share, 0.0), 1.0)
    variance = echo_variance + (1.0 - share) ** 2 * past[a]["variance"] + share**2 * past[b]["variance"]
    turned = noise * (ANY_SPEED * elapsed / length) ** 2
    return True, (ux, uy), moved, variance + off_line**2 / 12.0 + bent**2 + turned


@kernel
def is_confirmed(echo, measured, shared, later, parameters):
    """Tell whether a flow may rest, or an echo has moved as fast since another older scan.

    `echo` and `measured`, (normal, speed, variance), as for `along_normal`, in the world, [m/s] and [m^2/s^2];
    `shared` is what the poses add to a place's difference between two scans [m^2]; `later` are past (lag, beams),
    past_poses (lag,), order (S,), those of them to ask, and the time of the scan [s]. Without any all is confirmed.
    """
    ((nx, ny), speed, variance), (past, past_poses, order, time) = measured, later
    if len(order) == 0 or speed * speed <= SURE * variance:
        return True
    for k in order:
        elapsed, directions = time - past_poses[k]["time"], directions_of(past[k], parameters)
        found, (mx, my), moved, own = along_normal(echo, (past[k], past_poses[k], directions), elapsed, parameters)
        if found:
            error = moved / elapsed - speed
            total = variance + (own + shared) / elapsed**2
            return nx * mx + ny * my > ALIKE and error * error <= SAME * total
    return False
