"""The faces of a scan: echoes in a row that lie on one line, and one normal for all of a face.

Neighbours in a row are near enough (`may_share_face`); it is split where an echo is farthest off the line of both ends,
until none is off (iterative end point fit: Ramer, Computer Graphics and Image Processing 1(3), 1972). The normal is
that of total least squares over all echoes of the face; the line of two neighbours may be turned by 30 degrees.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.fitted_line import OFF_LINE
from pbrg_mj.perception.points.older_line import may_share_face
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE, store_scan

LEAST_ECHOES = 3  # of a face: the line of two is theirs alone
EXACT = 1e-8  # [m^2] least variance of a place
NO_PLACES = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # sums over places, as of `with_place`


class Faces(NamedTuple):
    """The faces of a scan, an entry a beam: of its echo and the next beam's."""

    found: np.ndarray  # (beams,) bool: both are of one face
    nx: np.ndarray  # (beams,) its normal, towards the robot
    ny: np.ndarray  # (beams,)
    variance: np.ndarray  # (beams,) of the normal's angle [rad^2]


@kernel
def scan_and_faces(seen, ends, pose, parameters):
    """Return the scan (beams,) of PAST_ECHO, as `store_scan` writes it, and its `Faces`.

    `seen` are `Echoes` and `SeenBeams`, `ends` (beams,) those of `free_ends`.
    """
    scan, scan_pose = np.empty(len(ends), PAST_ECHO), np.empty(1, PAST_POSE)
    store_scan(scan, scan_pose, seen, ends, pose)
    return scan, faces_of(scan, (pose.x, pose.y), parameters)


@kernel
def faces_of(scan, place, parameters):
    """Return the `Faces` of a scan (beams,) of PAST_ECHO, seen from a place (x, y) [m]."""
    beams = len(scan)
    faces = Faces(np.zeros(beams, np.bool_), np.empty(beams), np.empty(beams), np.empty(beams))
    start, first = _start(scan, parameters), 0
    while first < beams:
        last = first
        while last + 1 < beams and _goes_on(scan, start + last, parameters):
            last += 1
        if last > first:
            _split(scan, place, (start, first, last), faces)
        first = last + 1
    return faces


@kernel
def _start(scan, parameters):
    """Return a beam with which a row begins; the first one where beams do not go all the way round."""
    if parameters.closed:
        for k in range(len(scan)):
            if not _goes_on(scan, k - 1, parameters):
                return k
    return 0


@kernel
def _goes_on(scan, k, parameters):
    """Tell whether the echo of beam k, modulo their number, and the next may share a face."""
    k %= len(scan)
    return may_share_face(scan, k, next_beam(k, 1, parameters), parameters)


@kernel
def _split(scan, place, row, faces):
    """Write the faces of a row: beams from `first` to `last` after beam `start`, `row` (start, first, last)."""
    (start, first, last), beams = row, len(scan)
    ends, left = np.empty((last - first + 1, 2), np.int64), 1
    ends[0, 0], ends[0, 1] = first, last
    while left > 0:
        left -= 1
        first, last = ends[left, 0], ends[left, 1]
        at = _farthest(scan, place, (start, first, last))
        if at > 0:
            ends[left, 0], ends[left, 1], ends[left + 1, 0], ends[left + 1, 1] = first, at, at, last
            left += 2
        elif last - first + 1 >= LEAST_ECHOES:
            nx, ny, variance = _normal(scan, place, (start, first, last))
            for i in range(first, last):
                k = (start + i) % beams
                faces.found[k], faces.nx[k], faces.ny[k], faces.variance[k] = variance > 0.0, nx, ny, variance


@kernel
def _farthest(scan, place, row):
    """Return which beam of a row has the echo that is surely and farthest off the line of both ends; 0 for none."""
    (start, first, last), beams = row, len(scan)
    a, b, worst, at = (start + first) % beams, (start + last) % beams, OFF_LINE, 0
    x, y = scan[b]["x"] - scan[a]["x"], scan[b]["y"] - scan[a]["y"]
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0
    ux, uy = x / length, y / length
    noise_a, noise_b = _variance_along(scan, place, a, (-uy, ux)), _variance_along(scan, place, b, (-uy, ux))
    for i in range(first + 1, last):
        k = (start + i) % beams
        x, y = scan[k]["x"] - scan[a]["x"], scan[k]["y"] - scan[a]["y"]
        off, share = ux * y - uy * x, (ux * x + uy * y) / length
        noise = _variance_along(scan, place, k, (-uy, ux)) + (1.0 - share) ** 2 * noise_a + share**2 * noise_b
        squared = off * off / (noise + EXACT)
        if squared > worst:
            worst, at = squared, i
    return at


@kernel
def _variance_along(scan, place, k, n):
    """Return the variance of an echo's place along a unit vector [m^2]: its range's noise is along its beam."""
    cos = (n[0] * (scan[k]["x"] - place[0]) + n[1] * (scan[k]["y"] - place[1])) / scan[k]["range"]
    return cos * cos * scan[k]["variance"]


@kernel
def _normal(scan, place, row):
    """Return the normal nx, ny of a row's echoes, by total least squares, and the variance of its angle [rad^2]."""
    (start, first, last), beams = row, len(scan)
    a, sums = (start + first) % beams, NO_PLACES
    for i in range(first, last + 1):
        k = (start + i) % beams
        w, dx, dy = 1.0 / (scan[k]["variance"] + EXACT), scan[k]["x"] - scan[a]["x"], scan[k]["y"] - scan[a]["y"]
        sums = with_place(sums, w, dx, dy)
    (nx, ny), (x, y), spread = total_least_squares(sums)
    dx, dy = scan[a]["x"] + x - place[0], scan[a]["y"] + y - place[1]
    cos = (nx * dx + ny * dy) / math.hypot(dx, dy)
    if not spread > 0.0:
        return nx, ny, 0.0
    variance = cos * cos / spread
    return (-nx, -ny, variance) if cos > 0.0 else (nx, ny, variance)


@kernel
def with_place(sums, w, x, y):
    """Return the `sums` (6,) over places of w, w x, w y, w x x, w x y and w y y with one more place of weight w."""
    weight, sx, sy, xx, xy, yy = sums
    return weight + w, sx + w * x, sy + w * y, xx + w * x * x, xy + w * x * y, yy + w * y * y


@kernel
def total_least_squares(sums):
    """Return the line of the places of `sums` (6,): a unit normal (2,), their mean (2,) and their spread along it."""
    weight, x, y, xx, xy, yy = sums
    x, y = x / weight, y / weight
    xx, xy, yy = xx - weight * x * x, xy - weight * x * y, yy - weight * y * y
    angle, spread = 0.5 * math.atan2(2.0 * xy, xx - yy), 0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy))
    return (-math.sin(angle), math.cos(angle)), (x, y), spread
