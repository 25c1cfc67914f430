"""What a robot starts beside, nearer than beams tell.

What rests in the blind zone was seen before, and is remembered (memory.py), but where a robot starts nobody has seen
it. So the faces of its first scan that end at silent beams which their lines would meet within the shortest range are
taken to go on, along their lines, as far as these are so near and no two beams in a row pass by them. Where beams are
silent, the places are remembered as if they had echoed, until beams pass. A face is echoes in a row that are on the
line of those before, from its end on; its line is that of total least squares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import is_beside_blind_zone, next_beam
from pbrg_mj.perception.points.blind_zone import TURNED, place_on_line
from pbrg_mj.perception.points.fitted_line import OFF_LINE
from pbrg_mj.perception.points.memory import free_slot
from pbrg_mj.perception.points.scan_faces import EXACT, LEAST_ECHOES


class FaceLine(NamedTuple):
    """The line of a face that ends at an echo, which its places are told from."""

    nx: float  # unit normal
    ny: float
    x: float  # middle of its echoes [m]
    y: float
    variance: float  # of the normal's angle [rad^2]
    weight: float  # sum over its echoes of one over the variance of their ranges [1/m^2]


@kernel
def remember_blind_zone(points, scan, seen, pose, parameters):
    """Add to the memory `points` the places in the blind zone that the faces of a robot's first scan go on to.

    `points` (M,) of POINT is written, `scan` is the number of the scan; `seen` are `Echoes` and `SeenBeams`. A silent
    beam has at most one place, the nearest.
    """
    if parameters.half_cone > 0.0:  # which do not tell where in their view a thing is
        return
    (echoes, beams), count, place = seen, len(seen[0].x), -1
    nearest, x, y, of = np.full(count, np.inf), np.empty(count), np.empty(count), np.empty(count, np.int64)
    for i in range(count):
        if not (echoes.binds[i] and is_beside_blind_zone(beams.ranges[i], echoes.variance[i], pose, parameters)):
            continue
        for step in (1, -1):
            if not _falls_silent((i, step), beams.ranges, parameters):
                continue
            found, line = _line_in_blind_zone(echoes, (i, step), pose, parameters)
            passed = 0
            for away in range(1, count if found else 1):
                k = next_beam(i, away * step, parameters)
                if k < 0 or parameters.blocked[k]:
                    break
                met, dx, dy = place_on_line(line, k, beams, pose)
                squared = dx * dx + dy * dy
                passes = beams.ranges[k] > math.sqrt(squared) + 3.0 * math.sqrt(echoes.variance[k])
                passed = passed + 1 if passes else 0
                if not met or passed == 2:  # one may be an outlier
                    break
                if math.isnan(beams.ranges[k]) and squared < nearest[k]:
                    nearest[k], x[k], y[k], of[k] = squared, dx, dy, i
    for k in range(count):
        if nearest[k] < math.inf:
            place = free_slot(points, place + 1)
            _write_place(points[place], scan, (echoes, of[k]), (x[k], y[k]), pose)


@kernel
def _falls_silent(end, ranges, parameters):
    """Tell whether two of the next three beams beyond one, `end` (beam, step), have no echo: single ones get lost."""
    (i, step), silent = end, 0
    for away in (1, 2, 3):
        k = next_beam(i, away * step, parameters)
        silent += k >= 0 and not parameters.blocked[k] and math.isnan(ranges[k])
    return silent >= 2


@kernel
def _line_in_blind_zone(echoes, end, pose, parameters):
    """Return whether the line of the face that ends at an echo is known well enough, and it for `place_on_line`.

    `end` are the beam of the echo and the step, 1 or -1, to the next one beyond it.
    """
    line = _face_line(echoes, end)
    away = line.nx * (line.x - pose.x) + line.ny * (line.y - pose.y)
    sign = -1.0 if away > 0.0 else 1.0
    reach = parameters.range_min + 3.0 * math.sqrt(echoes.variance[end[0]])
    return line.variance <= TURNED, ((sign * line.nx, sign * line.ny), abs(away), reach)


@kernel
def _face_line(echoes, end):
    """Return the `FaceLine` of the echoes in a row that ends at an echo, up to the first that is surely off their line.

    `end` are the beam of the echo and the step, 1 or -1, to the next one beyond it.
    """
    (i, step), k, size, sums = end, end[0], 0, np.zeros(6)
    line = FaceLine(0.0, 0.0, 0.0, 0.0, math.inf, 0.0)
    while k >= 0 and size < len(echoes.x) and not _is_off(echoes, k, line):
        w, dx, dy = 1.0 / (echoes.variance[k] + EXACT), echoes.x[k] - echoes.x[i], echoes.y[k] - echoes.y[i]
        for place, value in enumerate((1.0, dx, dy, dx * dx, dx * dy, dy * dy)):
            sums[place] += w * value
        size += 1
        if size >= LEAST_ECHOES:
            line = _fitted(sums, (echoes, i))
        k = echoes.joined[k, 0 if step == 1 else 1]
    return line


@kernel
def _fitted(sums, origin):
    """Return the `FaceLine` of weighted sums (6,) of 1, x, y, x x, x y and y y from an echo, `origin` (echoes, i)."""
    (echoes, i), weight = origin, sums[0]
    x, y = sums[1] / weight, sums[2] / weight
    xx, xy, yy = sums[3] - weight * x * x, sums[4] - weight * x * y, sums[5] - weight * y * y
    angle, spread = 0.5 * math.atan2(2.0 * xy, xx - yy), 0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy))
    nx, ny = -math.sin(angle), math.cos(angle)
    across = nx * echoes.ux[i] + ny * echoes.uy[i]
    variance = across * across / spread if spread > 0.0 else math.inf
    return FaceLine(nx, ny, echoes.x[i] + x, echoes.y[i] + y, variance, weight)


@kernel
def _is_off(echoes, k, line):
    """Tell whether an echo is surely off a line whose normal is known."""
    if line.variance > TURNED:
        return False
    dx, dy = echoes.x[k] - line.x, echoes.y[k] - line.y
    off, along = line.nx * dx + line.ny * dy, line.nx * dy - line.ny * dx
    across = line.nx * echoes.ux[k] + line.ny * echoes.uy[k]
    noise = across * across * echoes.variance[k] + 1.0 / line.weight + along * along * line.variance
    return off * off > OFF_LINE * (noise + EXACT)


@kernel
def _write_place(point, scan, echo, way, pose):
    """Write a point that is known as well as an echo, (echoes, i), `way` (2,) from the robot's centre [m]."""
    (echoes, i), (dx, dy) = echo, way
    r = math.sqrt(dx * dx + dy * dy)
    point["x"], point["y"], point["time"], point["scan"] = pose.x + dx, pose.y + dy, pose.time, scan
    point["std"], point["turn_std"] = math.sqrt(echoes.variance[i]), r * math.sqrt(pose.heading_var)
    point["pose_std"] = math.sqrt(pose.position_var + r * r * pose.heading_var)
    point["ux"], point["uy"], point["beam"], point["passed"] = dx / r, dy / r, -1, 0
    point["protrusion"], point["slack"], point["along_x"], point["along_y"] = 0.0, 0.0, 0.0, 0.0
    point["vx"], point["vy"], point["confirmed_within"] = 0.0, 0.0, math.inf
    point["live"], point["binds"] = True, True
