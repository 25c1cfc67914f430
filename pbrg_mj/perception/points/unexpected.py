"""Which echoes are where the scan before saw nothing.

An echo ahead of the line between the two echoes on either side of it in the scan before, by more than ranges are wrong,
is of a thing that came nearer, of one that was between those two beams, or an outlier. Where these two are of different
faces, or of one that is seen at a grazing angle, it is so if it is ahead of the lines that go on from either side.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import beams_beside, next_beam
from pbrg_mj.perception.points.older_line import may_share_face
from pbrg_mj.perception.points.past_scan import LONGEST, directions_of

DEVIATIONS = 5.0  # of ranges and poses
UNKNOWN, EXPECTED, UNEXPECTED = 0, 1, 2


@kernel
def unexpected_echoes(echoes, before, pose, parameters):
    """Return what each echo (beams,) is: `UNEXPECTED`, `EXPECTED`, or `UNKNOWN` where the scan before saw no face.

    All are unknown of a sensor without outliers.

    `before` are past (lag, beams) of PAST_ECHO and past_poses (lag,) of PAST_POSE.
    """
    past, past_poses = before
    found, newest = np.full(len(echoes.x), UNKNOWN), 0
    for i in range(len(past_poses)):
        if past_poses[i]["known"] and not past_poses[newest]["time"] >= past_poses[i]["time"]:
            newest = i
    then = past_poses[newest]
    elapsed = pose.time - then["time"]
    if not parameters.outliers or not then["known"] or not 0.0 < elapsed <= LONGEST:
        return found
    directions = directions_of(past[newest], parameters)
    for k in range(len(found)):
        if echoes.external[k]:
            dx, dy = echoes.x[k] - then["x"], echoes.y[k] - then["y"]
            a, b = beams_beside(dx, dy, then["heading"], directions, parameters)
            if b < 0:
                continue
            if may_share_face(past[newest], a, b, parameters):
                found[k] = UNEXPECTED if _is_ahead(echoes, k, (past[newest], a, b), then) else EXPECTED
                continue
            for near, far in ((a, next_beam(a, -1, parameters)), (b, next_beam(b, 1, parameters))):
                if far >= 0 and may_share_face(past[newest], near, far, parameters):
                    found[k] = UNEXPECTED if _is_ahead(echoes, k, (past[newest], near, far), then) else EXPECTED
                    if found[k] == EXPECTED:
                        break
    return found


@kernel
def _is_ahead(echoes, k, line, then):
    """Tell whether echo k is ahead of a line (past, a, b) of the scan before by more than noise explains.

    `then` is the record PAST_POSE of that scan. A range is wrong along its beam, of which the normal sees a part.
    """
    past, a, b = line
    x, y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return False
    nx, ny = -y / length, x / length
    if nx * (past[a]["x"] - then["x"]) + ny * (past[a]["y"] - then["y"]) > 0.0:  # towards where the robot was
        nx, ny = -nx, -ny
    ahead = nx * (echoes.x[k] - past[a]["x"]) + ny * (echoes.y[k] - past[a]["y"])
    dx, dy = echoes.x[k] - then["x"], echoes.y[k] - then["y"]
    meets = dx * y - dy * x
    if meets == 0.0:  # along the line
        return False
    # Noise of two ranges turns a short line: it is asked where the way to the echo meets it, not where it is nearest.
    share = (dy * (past[a]["x"] - then["x"]) - dx * (past[a]["y"] - then["y"])) / meets
    variance = echoes.variance[k] * (nx * echoes.ux[k] + ny * echoes.uy[k]) ** 2 + 2.0 * echoes.pose_std[k] ** 2
    for end, weight in ((a, 1.0 - share), (b, share)):
        ux, uy = (past[end]["x"] - then["x"]) / past[end]["range"], (past[end]["y"] - then["y"]) / past[end]["range"]
        variance += weight * weight * past[end]["variance"] * (nx * ux + ny * uy) ** 2
    return ahead > DEVIATIONS * math.sqrt(variance)
