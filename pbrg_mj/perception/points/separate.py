"""Half-spaces between the path of a hand point to its target and the places to keep off.

The path is the segment from the hand point q to its target b_i + m_i under the reference that is held, as far as it is
free. Half-spaces follow one another as in safe flight corridors (Liu et al., RA-L 2(3), 2017, with discs in place of
ellipsoids): the place nearest to the path begins a face, all places that the face keeps off are done with, the next
nearest of the others begins the next. A face is the hull of the places in a window around the nearest one, and its
normal that of the widest gap between the hull and the path; the window shrinks until the hull leaves the path most of
the distance that its nearest place leaves. Every half-space is moved towards the robot by the clearance and by what its
places may be wrong by.

No place is left out. Where there are more faces than slots, the last four slots are a box around the path: each place
that the faces before do not keep off is kept off by the side of the box that it is most ahead of, which leaves 0.7 or
more of its distance to the path.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face import clearance_along, hysteresis, next_face, offset, points_not_separated
from pbrg_mj.perception.points.lines import write_line
from pbrg_mj.perception.points.obstacle_points import (
    copy_point,
    empty_points,
    free_path,
    measure_from,
    obstacle_points,
)
from pbrg_mj.perception.points.straight_face import straight_face

SIDES = 4  # of the box around the path
SAME_FACE = math.cos(math.radians(20.0))  # between the normals of one face in two scans


@kernel
def separate(seen, q, target, parameters, half_spaces):
    """Write half-spaces for the hand point q (2,) [m] on its way to `target` (2,) [m].

    They are G (K, 2), h (K,), active (K,), nearest (K, 2), the place of each that is nearest to the path [m], and
    lines (K, FIELDS), the `Line`s of their faces as `write_line` writes them.

    `seen` (points, edge) are the memory and the `Edge`. On entry the half-spaces are those of the scan before, whose
    slots and, where they serve as well, normals are taken over. K is four or more.
    """
    G, h, active, _, _ = half_spaces
    places, count = obstacle_points(seen[0], seen[1], parameters)
    window = empty_points(count, seen[0])
    path = free_path(places, count, q, target, parameters)
    measure_from(path, places, count)
    before = G.copy(), active.copy(), np.zeros(len(h), np.bool_)
    taken = before[2]
    faces, before_box, taken_before_box = 0, count, taken.copy()
    while count > 0 and faces < len(h):
        if faces == len(h) - SIDES:
            before_box, taken_before_box = count, taken.copy()
        size, normal, nearest = next_face(places, count, window, path)
        if size == 0:
            count = 0
            break
        half_space, line = _write((window, size, path), (normal, nearest), before, half_spaces, parameters)
        count = points_not_separated(places, count, (half_space, line), parameters)
        faces += 1
    if count > 0:
        taken[:] = taken_before_box
        _box(places, before_box, (window, path), before, half_spaces, parameters)
    for k in range(len(h)):
        active[k] = taken[k]
        if not taken[k]:
            G[k, 0], G[k, 1], h[k] = 0.0, 0.0, 0.0


@kernel
def _box(places, count, window_and_path, before, half_spaces, parameters):
    """Write a half-space for each side of the box around the path that keeps off any of the places."""
    window, path = window_and_path
    dx, dy = path[2] - path[0], path[3] - path[1]
    length = math.sqrt(dx * dx + dy * dy)
    ux, uy = (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
    for side in range(SIDES):
        size, nearest, best = 0, (0.0, 0.0), math.inf
        for i in range(count):
            x, y = places.x[i] - path[0], places.y[i] - path[1]
            along = x * ux + y * uy
            along, across = along - min(max(along, 0.0), length), y * ux - x * uy
            if _side(along, across) == side:
                copy_point(places, i, window, size)
                size += 1
                if along * along + across * across < best:
                    nearest, best = (places.x[i], places.y[i]), along * along + across * across
        if size > 0:
            sign = 1.0 if side < 2 else -1.0
            normal = (sign * ux, sign * uy) if side % 2 == 0 else (-sign * uy, sign * ux)
            _write((window, size, path), (normal, nearest), before, half_spaces, parameters)


@kernel
def _side(along, across):
    """Return the side of the box that a place is most ahead of: 0 ahead, 1 left, 2 behind, 3 right."""
    if abs(along) >= abs(across):
        return 0 if along >= 0.0 else 2
    return 1 if across > 0.0 else 3


@kernel
def _write(face, normal_and_nearest, before, half_spaces, parameters):
    """Write the half-space of a face to its slot; return it as `points_not_separated` takes it, with its `Line`.

    `face` (window, size, path); `normal_and_nearest` are its normal (2,) and its nearest_place (2,) [m]; `before` are
    the normals of the scan before, old (K, 2), was_active (K,) and taken (K,) bool, whether a slot has a half-space of
    this scan; `half_spaces` those of `separate`, where nearest_places (K, 2) is nearest.
    """
    G, h, _, nearest_places, lines = half_spaces
    (normal, nearest_place), (old, was_active, taken) = normal_and_nearest, before
    line = straight_face(face, normal, parameters)
    if line.found:
        normal = line.gx, line.gy
    k = _slot(face, normal, before)
    if not line.found and was_active[k] and normal[0] * old[k, 0] + normal[1] * old[k, 1] > SAME_FACE:
        normal = (old[k, 0], old[k, 1])
    taken[k] = True
    G[k, 0], G[k, 1] = normal
    nearest_places[k, 0], nearest_places[k, 1] = nearest_place
    write_line(line, lines, k)
    if line.found:
        nearest = line.offset - parameters.clearance
        h[k] = nearest - parameters.sigmas * line.std
    else:
        nearest, h[k] = offset(face[0], face[1], normal, parameters)
    return (normal, nearest, h[k]), line


@kernel
def _slot(face, normal, before):
    """Return the slot of the same face in the scan before, if its normal serves as well; else a free one."""
    old, was_active, taken = before
    least, free = clearance_along(face, normal) - hysteresis(face, normal), -1
    for k in range(len(taken)):
        if taken[k]:
            continue
        if was_active[k] and normal[0] * old[k, 0] + normal[1] * old[k, 1] > SAME_FACE:
            if clearance_along(face, (old[k, 0], old[k, 1])) >= least:
                return k
        elif free < 0 or (was_active[free] and not was_active[k]):
            free = k
    if free >= 0:
        return free
    for k in range(len(taken)):  # all that are left had the same face, with a normal that no longer serves
        if not taken[k]:
            was_active[k] = False
            return k
    return -1
