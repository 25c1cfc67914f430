"""Faces that move and go on in the blind zone, where they are nearer than beams tell.

A beam has no echo of what is nearer than its shortest range. So of a face beside a robot a part may be seen, at one end
or at both, and a half-space turns to the nearest place that is. Where a face ends at a silent beam which its line would
meet within that range, and so at the next one (single echoes get lost), it is taken to go on: along its line, as far as
beams are silent and the line is so near. If no half-space keeps the nearest of these places off, the face has one of
its own, where a slot is free: that of its line. It keeps off all of a convex thing, so that of two faces at a corner
the one suffices that the robot is farther ahead of. What rests needs none of this: its places were seen before, and are
not forgotten (memory.py), but for those where a robot starts (initial_blind_zone.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.beams import next_beam
from pbrg_mj.perception.points.face_track import any_moving_within
from pbrg_mj.perception.points.motion import BESIDE

TURNED = 0.002  # [rad^2] variance of a normal, 2.6 deg, beyond which its line is not known where it is not seen
ROUNDING = 0.01  # [m] by which a place may be ahead of what keeps it off, for noise
MOST_FACES = 8


class BlindZoneFaces(NamedTuple):
    """Faces that move and go on in the blind zone; functions look at the first entries of each array."""

    nx: np.ndarray  # (F,) normal towards the robot
    ny: np.ndarray  # (F,)
    x: np.ndarray  # (F,) nearest unseen place [m]
    y: np.ndarray  # (F,)
    end_x: np.ndarray  # (F,) last echo [m]
    end_y: np.ndarray  # (F,)
    ahead: np.ndarray  # (F,) how far the hand point is ahead of its line [m]


@kernel
def add_blind_zone_faces(seen, faces, tracks, pose, parameters, half_spaces):
    """Add half-spaces of faces that move and go on in the blind zone, in slots that are free.

    `seen` are `Echoes` and `SeenBeams`, `faces` their `Faces`; `half_spaces` those of `separate`.
    """
    if parameters.half_cone > 0.0:  # which do not tell where in their view a thing is
        return
    G, h, active, nearest, _ = half_spaces
    unseen, left = _blind_zone_faces(seen, faces, tracks, pose, parameters)
    while left > 0:
        best = np.argmax(unseen.ahead[:left])
        nx, ny, x, y = unseen.nx[best], unseen.ny[best], unseen.x[best], unseen.y[best]
        if not _is_kept_off(half_spaces, parameters.clearance, x, y):
            slot = 0
            while slot < len(h) and active[slot]:
                slot += 1
            if slot == len(h):
                return
            G[slot, 0], G[slot, 1], active[slot] = -nx, -ny, True
            h[slot] = -(nx * x + ny * y) - parameters.clearance
            nearest[slot, 0], nearest[slot, 1] = x, y
        left = _without_those_behind(unseen, left, (nx, ny, x, y))


@kernel
def _blind_zone_faces(seen, faces, tracks, pose, parameters):
    """Return the `BlindZoneFaces` of a scan, and how many there are."""
    (echoes, beams), count, most = seen, 0, MOST_FACES
    places = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    unseen = BlindZoneFaces(np.empty(most), np.empty(most), *places, np.empty(most))
    for i in range(len(echoes.x)):
        for step in (1, -1):
            k = next_beam(i, -1, parameters) if step == 1 else i
            if k < 0 or not faces.found[k] or faces.variance[k] > TURNED or count == most:
                continue
            if not any_moving_within(tracks, (echoes.x[i], echoes.y[i]), BESIDE):
                continue
            nx, ny = faces.nx[k], faces.ny[k]
            away = -(nx * (echoes.x[i] - pose.x) + ny * (echoes.y[i] - pose.y))
            reach = parameters.range_min + 3.0 * math.sqrt(echoes.variance[i])
            found, x, y = _nearest_unseen((i, step), ((nx, ny), away, reach), beams, pose, parameters)
            if found:
                unseen.nx[count], unseen.ny[count], unseen.x[count], unseen.y[count] = nx, ny, x, y
                unseen.end_x[count], unseen.end_y[count] = echoes.x[i], echoes.y[i]
                hand = parameters.hand_offset * (nx * math.cos(pose.heading) + ny * math.sin(pose.heading))
                unseen.ahead[count] = away + hand
                count += 1
    return unseen, count


@kernel
def _is_kept_off(half_spaces, clearance, x, y):
    """Tell whether a place is behind what some half-space keeps off."""
    G, h, active, _, _ = half_spaces
    return bool((active & (G[:, 0] * x + G[:, 1] * y >= h + clearance - ROUNDING)).any())


@kernel
def _without_those_behind(unseen, count, line):
    """Take out the faces that end on or behind the line of one, (nx, ny, x, y); return how many are left."""
    (nx, ny, x, y), kept = line, 0
    for i in range(count):
        if nx * (unseen.end_x[i] - x) + ny * (unseen.end_y[i] - y) > ROUNDING:
            for member in unseen:
                member[kept] = member[i]
            kept += 1
    return kept


@kernel
def _nearest_unseen(end, line, beams, pose, parameters):
    """Return (found, x, y): where a line is nearest to the hand point, of its places on silent beams [m].

    `end` are the beam i of a face's last echo and the step, 1 or -1, to the next one beyond it; `line` its normal n
    (nx, ny) towards the robot, how far away it is and the reach within which beams have no echo [m].
    """
    i, step = end
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    found, best, x, y = False, math.inf, 0.0, 0.0
    for steps in range(1, len(beams.ranges)):
        k = next_beam(i, steps * step, parameters)
        if k < 0 or parameters.blocked[k] or not math.isnan(beams.ranges[k]):
            break
        met, dx, dy = beam_line_intersection(line, k, beams, pose)
        if not met:
            break
        from_hand_x, from_hand_y = dx - parameters.hand_offset * cos, dy - parameters.hand_offset * sin
        squared = from_hand_x * from_hand_x + from_hand_y * from_hand_y
        found = steps > 1
        if squared < best:
            best, x, y = squared, pose.x + dx, pose.y + dy
    return found, x, y


@kernel
def beam_line_intersection(line, k, beams, pose):
    """Return (met, dx, dy): whether beam k meets a line in the blind zone, and where, from the robot's centre [m].

    `line` are its normal n (nx, ny) towards the robot, how far away it is [m] and the reach within which beams have no
    echo [m].
    """
    ((nx, ny), away, reach), cos, sin = line, math.cos(pose.heading), math.sin(pose.heading)
    ahead, aside = beams.directions[k, 0], beams.directions[k, 1]
    ux, uy = cos * ahead - sin * aside, sin * ahead + cos * aside
    towards = -(nx * ux + ny * uy)
    if towards * reach <= away:
        return False, 0.0, 0.0
    return True, away / towards * ux, away / towards * uy
