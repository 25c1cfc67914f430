"""What an echo takes the place of: points of older scans on the part of a face that it tells of.

A thin thing between two beams is missed by most scans. What these see beside it, or behind it, does not take its place,
and neither does an echo that is not yet confirmed: what once was confirmed stays until beams pass it (memory.py).
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.segment import vector_from_segment

BESIDE = 0.02  # [m] besides noise that a point may be off a face: what two echoes on it leave a corner


@kernel
def delete_replaced(points, scan, echoes, pose, parameters):
    """Take out points older than the recent scans where there is an echo again, at their place and on their face.

    Only echoes that bind count; one is confirmed by a confirmed point that it takes the place of, as far off as
    that is. `delete_stale` told which beam's echo may be at a point's place.
    """
    for i in range(len(points)):
        point = points[i]
        beam = point["beam"]
        if point["live"] and beam >= 0 and scan - point["scan"] >= parameters.recent and echoes.binds[beam]:
            point["live"] = not _is_on_face(point, (echoes, beam), pose, parameters)
            if not point["live"] and point["confirmed_within"] < math.inf:
                away = math.sqrt((point["x"] - echoes.x[beam]) ** 2 + (point["y"] - echoes.y[beam]) ** 2)
                echoes.confirmed_within[beam] = min(echoes.confirmed_within[beam], away)


@kernel
def _is_on_face(point, echo, pose, parameters):
    """Tell whether a point is at an echo, (echoes, beam), or between it and the next one, within three deviations.

    A cone's echo may be anywhere across it.
    """
    echoes, beam = echo
    away_x, away_y = point["x"] - pose.x, point["y"] - pose.y
    other = echoes.joined[beam, 1 if echoes.ux[beam] * away_y > echoes.uy[beam] * away_x else 0]
    end = other if other >= 0 else beam
    segment = echoes.x[beam], echoes.y[beam], echoes.x[end], echoes.y[end]
    x, y = vector_from_segment(segment, point["x"], point["y"])
    variance = point["std"] ** 2 + point["pose_std"] ** 2 + echoes.variance[beam] + echoes.pose_std[beam] ** 2
    across = parameters.half_cone * math.sqrt(away_x * away_x + away_y * away_y)
    tolerance = 3.0 * math.sqrt(variance) + BESIDE + across
    return x * x + y * y <= tolerance * tolerance
