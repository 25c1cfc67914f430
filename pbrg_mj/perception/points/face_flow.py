"""Range flow of whole faces: how far echoes lie off the faces of an older scan, each face along one normal.

Noise turns the line of two echoes (older_line.py), and where a thing slides along its face, each turned line tells that
it does so more slowly than it does, or not at all: the attenuation of least squares whose regressors have errors. All
echoes of a face, in both scans, tell its normal to a degree or two. So it tells of the speed along that normal, and
slanted faces tell as well. Where a face goes on round a corner it has no free end: its other face tells.
"""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import beams_beside, next_beam
from pbrg_mj.perception.points.normal_flow import FASTEST, STEEP, along_normal
from pbrg_mj.perception.points.older_line import may_share_face
from pbrg_mj.perception.points.past_scan import LONGEST, directions_of
from pbrg_mj.perception.points.range_flow import LEFT, NEAR, RIGHT, append_end, append_flow, empty_flow
from pbrg_mj.perception.points.scan_faces import faces_of

TURNED = 9.0  # squared deviations between the normals of one face in two scans


@kernel
def face_flow(seen, of_scan, resting, before, pose, parameters):
    """Return the `RangeFlow` of faces, and how many entries it has.

    `seen` are `Echoes` and `SeenBeams`, `of_scan` what `scan_and_faces` returns, resting (beams,) bool and the others
    as for `range_flow`. An echo that is on no face of three echoes in both scans has the normal flow that it has there.
    """
    (echoes, beams), (scan, newer), (past, past_pose) = seen, of_scan, before
    flows, elapsed, count = empty_flow(2 * len(scan)), pose.time - past_pose["time"], 0
    if not past_pose["known"] or not 0.0 < elapsed <= LONGEST:
        return flows, 0
    now = scan, pose, newer
    older = past, past_pose, directions_of(past, parameters)
    faces = faces_of(past, (past_pose["x"], past_pose["y"]), parameters)
    for i in range(len(scan)):
        if not echoes.external[i] or beams.ranges[i] > NEAR or resting[i]:
            continue
        echo = echoes.x[i], echoes.y[i], echoes.variance[i]
        on_faces, found, n, moved, variance = _along_face(i, now, older, faces, parameters)
        if not on_faces:
            found, n, moved, variance = along_normal(echo, older, elapsed, parameters)
        if found:
            count = append_flow(flows, count, (echoes, i), n, (moved, variance), elapsed)
        sides = _free_sides(scan, i, parameters)
        if sides != 0:
            count = append_end((flows, count), (echoes, i), sides, (past, past_pose), pose, parameters)
    return flows, count


@kernel
def _free_sides(scan, i, parameters):
    """Return the sides on which the face of echo i of a scan (beams,) ends, but for corners.

    There the neighbour may share it.
    """
    sides = scan[i]["ends"]
    if sides & LEFT and may_share_face(scan, i, next_beam(i, 1, parameters), parameters):
        sides -= LEFT
    if sides & RIGHT and may_share_face(scan, i, next_beam(i, -1, parameters), parameters):
        sides -= RIGHT
    return sides


@kernel
def _along_face(i, now, before, faces, parameters):
    """Return (on_faces, found, normal, moved, variance): how far echo i lies off a face of an older scan [m], [m^2].

    `now` are scan (beams,) of PAST_ECHO, pose and its `Faces`, `before` past, past_pose and directions, `faces` those
    of past. Not `on_faces` is an echo without a face in one of both scans; not `found` one whose faces have not the
    same normal.
    """
    (scan, pose, newer), (past, past_pose, directions) = now, before
    none, elapsed = (False, (0.0, 0.0), 0.0, 0.0), pose.time - past_pose["time"]
    dx, dy = scan[i]["x"] - past_pose["x"], scan[i]["y"] - past_pose["y"]
    a, b = beams_beside(dx, dy, past_pose["heading"], directions, parameters)
    k = _better_face(newer, i, next_beam(i, -1, parameters))
    if b < 0 or not (faces.found[a] and newer.found[k]):
        return False, *none
    same, (nx, ny) = _common_normal(faces, a, newer, k)
    distance = math.sqrt(dx * dx + dy * dy)
    slant = -(nx * (scan[i]["x"] - pose.x) + ny * (scan[i]["y"] - pose.y)) / scan[i]["range"]
    slant_then = -(nx * dx + ny * dy) / distance
    if not same or min(slant, slant_then) < STEEP:
        return True, *none
    ahead, variance = _range_between((past, past_pose), (a, b), (dx / distance, dy / distance))
    moved = slant_then * (ahead - distance)
    if abs(moved) > FASTEST * elapsed + 3.0 * math.sqrt(scan[i]["variance"]):
        return True, *none
    variance = slant**2 * scan[i]["variance"] + slant_then**2 * variance
    off_line = max(past[a]["off_line"], past[b]["off_line"])
    return True, True, (nx, ny), moved, variance + off_line**2 / 12.0


@kernel
def _better_face(faces, left, right):
    """Return which of two of the `Faces` is known better; either where there is none."""
    if right < 0 or not faces.found[right]:
        return left
    return left if faces.found[left] and faces.variance[left] <= faces.variance[right] else right


@kernel
def _common_normal(older, a, newer, b):
    """Return (same, normal) of a face of each scan, `Faces` and its entry: the mean of both normals.

    Each counts by the variance of its angle [rad^2]; `same` is whether they differ by no more than these explain.
    """
    nx, ny, mx, my = older.nx[a], older.ny[a], newer.nx[b], newer.ny[b]
    cos, sin, total = nx * mx + ny * my, nx * my - ny * mx, older.variance[a] + newer.variance[b]
    if cos <= 0.0 or sin * sin > TURNED * total:
        return False, (0.0, 0.0)
    share = newer.variance[b] / total
    nx, ny = share * nx + (1.0 - share) * mx, share * ny + (1.0 - share) * my
    length = math.sqrt(nx * nx + ny * ny)
    return True, (nx / length, ny / length)


@kernel
def _range_between(before, pair, u):
    """Return how far ahead along a unit vector u (2,) the line of two neighbours is, and its variance [m], [m^2].

    `before` are past and past_pose, `pair` the beams a and b of the two.
    """
    (past, past_pose), (a, b) = before, pair
    x, y = past[a]["x"] - past_pose["x"], past[a]["y"] - past_pose["y"]
    along_x, along_y = past[b]["x"] - past[a]["x"], past[b]["y"] - past[a]["y"]
    ahead = (x * along_y - y * along_x) / (u[0] * along_y - u[1] * along_x)
    share = (ahead * u[0] - x) * along_x + (ahead * u[1] - y) * along_y
    share = min(max(share / (along_x * along_x + along_y * along_y), 0.0), 1.0)
    return ahead, (1.0 - share) ** 2 * past[a]["variance"] + share**2 * past[b]["variance"]
