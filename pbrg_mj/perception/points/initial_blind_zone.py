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
from pbrg_mj.perception.points.blind_zone import TURNED, beam_line_intersection
from pbrg_mj.perception.points.fitted_line import OFF_LINE
from pbrg_mj.perception.points.memory import free_slot, write_point
from pbrg_mj.perception.points.scan_faces import EXACT, LEAST_ECHOES, NO_PLACES, total_least_squares, with_place


class LineFit(NamedTuple):
    """The line of a face by total least squares."""

    nx: float  # unit normal
    ny: float
    x: float  # mean of its echoes [m]
    y: float
    variance: float  # of the normal's angle [rad^2]
    weight: float  # sum over its echoes of one over the variance of their ranges [1/m^2]


class Extrapolated(NamedTuple):
    """Where silent beams meet what faces go on to, an entry a beam, from the robot's centre."""

    squared: np.ndarray  # (beams,) of its distance [m^2], infinite where there is none
    x: np.ndarray  # (beams,) [m]
    y: np.ndarray  # (beams,) [m]
    echo: np.ndarray  # (beams,) the last echo of its face


@kernel
def extrapolate_into_blind_zone(points, scan, seen, pose, parameters):
    """Add to the memory `points` the places in the blind zone that the faces of a robot's first scan go on to.

    `points` (M,) of POINT is written, `scan` is the number of the scan; `seen` are `Echoes` and `SeenBeams`. A silent
    beam has at most one place, the nearest.
    """
    if parameters.half_cone > 0.0:  # which do not tell where in their view a thing is
        return
    (echoes, beams), count, slot = seen, len(seen[0].x), -1
    places = Extrapolated(np.full(count, np.inf), np.empty(count), np.empty(count), np.empty(count, np.int64))
    for i in range(count):
        if not (echoes.binds[i] and is_beside_blind_zone(beams.ranges[i], echoes.variance[i], pose, parameters)):
            continue
        for step in (1, -1):
            if _falls_silent((i, step), beams.ranges, parameters):
                _extrapolate(seen, (i, step), places, pose, parameters)
    for k in range(count):
        if places.squared[k] < math.inf:
            slot = free_slot(points, slot + 1)
            _write_place(points[slot], scan, echoes, (places, k), pose)


@kernel
def _extrapolate(seen, end, places, pose, parameters):
    """Write to `places` where the line of a face meets the silent beams beyond its last echo.

    `seen` are `Echoes` and `SeenBeams`; `end` are the beam of the echo and the step, 1 or -1, to the next one beyond.
    """
    (echoes, beams), (i, step), passed = seen, end, 0
    found, line = _line_in_blind_zone(echoes, end, pose, parameters)
    for away in range(1, len(echoes.x) if found else 1):
        k = next_beam(i, away * step, parameters)
        if k < 0 or parameters.blocked[k]:
            break
        met, x, y = beam_line_intersection(line, k, beams, pose)
        if not met:
            break
        squared = x * x + y * y
        if math.isnan(beams.ranges[k]):
            passed = 0
            if squared < places.squared[k]:
                places.squared[k], places.x[k], places.y[k], places.echo[k] = squared, x, y, i
        elif beams.ranges[k] > math.sqrt(squared) + 3.0 * math.sqrt(echoes.variance[k]):
            passed += 1
            if passed == 2:  # one may be an outlier
                break
        else:
            passed = 0


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
    """Return whether the line of the face that ends at an echo is known well enough, and it for an intersection.

    `end` are the beam of the echo and the step, 1 or -1, to the next one beyond it.
    """
    line = _face_line(echoes, end)
    away = line.nx * (line.x - pose.x) + line.ny * (line.y - pose.y)
    sign = -1.0 if away > 0.0 else 1.0
    reach = parameters.range_min + 3.0 * math.sqrt(echoes.variance[end[0]])
    return line.variance <= TURNED, ((sign * line.nx, sign * line.ny), abs(away), reach)


@kernel
def _face_line(echoes, end):
    """Return the `LineFit` of the echoes in a row that ends at an echo, up to the first that is surely off their line.

    `end` are the beam of the echo and the step, 1 or -1, to the next one beyond it.
    """
    (i, step), k, size, sums = end, end[0], 0, NO_PLACES
    line = LineFit(0.0, 0.0, 0.0, 0.0, math.inf, 0.0)
    while k >= 0 and size < len(echoes.x) and not _is_off(echoes, k, line):
        w, dx, dy = 1.0 / (echoes.variance[k] + EXACT), echoes.x[k] - echoes.x[i], echoes.y[k] - echoes.y[i]
        sums = with_place(sums, w, dx, dy)
        size += 1
        if size >= LEAST_ECHOES:
            (nx, ny), (x, y), spread = total_least_squares(sums)
            across = nx * echoes.ux[i] + ny * echoes.uy[i]
            variance = across * across / spread if spread > 0.0 else math.inf
            line = LineFit(nx, ny, echoes.x[i] + x, echoes.y[i] + y, variance, sums[0])
        k = echoes.joined[k, 0 if step == 1 else 1]
    return line


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
def _write_place(point, scan, echoes, place, pose):
    """Write a `place`, (places, k), as a point that is known as well as the last echo of its face."""
    places, k = place
    r, x, y = math.sqrt(places.squared[k]), places.x[k], places.y[k]
    pose_std = math.sqrt(pose.position_var + places.squared[k] * pose.heading_var)
    stds = math.sqrt(echoes.variance[places.echo[k]]), pose_std, r * math.sqrt(pose.heading_var)
    write_point(point, (pose.x + x, pose.y + y), (x / r, y / r), stds, (pose.time, scan))
