"""How fast what half-spaces keep off comes nearer.

A half-space keeps off several things, and one that comes may be behind one that stands, or slide along it. So the faces
behind a half-space are taken one after the other, nearest first, each from the flow that the tracks (motion.py) of
those before do not explain. What is nearer than the clearance from its edge, other half-spaces keep off.

A face at the distance D behind the first one, along the normal, and at the speed c reaches the first one's place after
D / c. Until a robot reacts, after T, h falls by the largest of c T - D. From then on the robot gives way at the largest
of c - D / (4 T): at that rate distances behind a lag T fall without oscillating.

What comes is kept in sight: of what is nearer to a robot than its beams tell nobody knows how fast it comes.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.blind_zone import add_blind_zone_faces
from pbrg_mj.perception.points.blind_zone_points import blind_zone_margin
from pbrg_mj.perception.points.face import REACH
from pbrg_mj.perception.points.face_flow import face_flow
from pbrg_mj.perception.points.face_span import face_span
from pbrg_mj.perception.points.face_track import any_moving, closing_speed
from pbrg_mj.perception.points.gate import count_flows_in_gate, flows_outside_gate
from pbrg_mj.perception.points.lines import echoes_on_lines, line_at
from pbrg_mj.perception.points.motion import BESIDE, flows_beside, track_at
from pbrg_mj.perception.points.past_scan import scans_by_age, store_scan
from pbrg_mj.perception.points.range_flow import free_ends, range_flow
from pbrg_mj.perception.points.scan_faces import scan_and_faces

FACES = 4  # of a half-space that are looked at
AGREEING = 3  # flows that make a face of what is left: both ends of what is round seem to move


@kernel
def move_half_spaces(seen, motion, pose, parameters, half_spaces, coming):
    """Lower h of half-spaces by how far what they keep off comes until a robot reacts, and so that beams tell of it.

    `coming` are closing (K,) [m/s], which becomes how fast it comes along the normal from then on, 0 for what rests,
    and spans (K, 2) [m], the `face_span` of what comes. `seen` are a scan's echoes and its beams; `motion` past (lag,
    beams) of PAST_ECHO, past_poses (lag,) of PAST_POSE and tracks (T,); `half_spaces` those of `separate`. The scan is
    stored in `past`. Returned are the flows of faces, and how many: none where no track moves.
    """
    (echoes, beams), (past, past_poses, tracks), (G, h, active, nearest, lines) = seen, motion, half_spaces
    closing, spans = coming
    order, ends = scans_by_age(past_poses), free_ends(echoes, beams.ranges, pose, parameters)
    written = order[0] if len(order) == len(past_poses) else len(order)
    resting = echoes_on_lines(echoes, lines)
    flows, count = range_flow((echoes, beams.ranges), (ends, resting), (past, past_poses, order), pose, parameters)
    of_faces = flows, 0
    if any_moving(tracks):
        scan, faces = scan_and_faces(seen, ends, pose, parameters)
        add_blind_zone_faces(seen, faces, tracks, pose, parameters, half_spaces)
        before = past[order[0]], past_poses[order[0]]  # where a track moves there is one
        of_faces = face_flow(seen, (scan, faces), resting, before, pose, parameters)
    measured = (flows, count), of_faces
    for k in range(len(h)):
        closing[k] = 0.0
        if active[k]:
            half_space = (G[k, 0], G[k, 1]), h[k] + parameters.clearance, (nearest[k, 0], nearest[k, 1])
            line = line_at(lines, k)
            faces = tracks, line.found
            speed, lead, place = _approach(echoes, faces, half_space, measured, pose.time, parameters.reaction)
            closing[k] = max(speed, line.speed)
            h[k] -= max(lead, parameters.reaction * line.speed)
            if closing[k] > 0.0:
                h[k] -= blind_zone_margin(parameters)
                spans[k, 0], spans[k, 1] = face_span(seen, half_space[0], place, pose, parameters)
    store_scan(past[written], past_poses[written : written + 1], seen, ends, pose)
    return of_faces


@kernel
def _approach(echoes, faces, half_space, measured, time, reaction):
    """Return how fast what a half-space keeps off comes [m/s], by how much h falls [m], and where its face is (2,).

    The half-space is its normal, its edge where faces begin, h + clearance, and its nearest place. The first face is
    where the scan says; each other where the flow that is left is nearest along the normal. `faces` are the tracks and
    whether the first one is a straight face at rest; `measured` the scan's `range_flow` and its `face_flow`, which has
    no entries where no track moves.
    """
    (normal, edge, near), (tracks, rests) = half_space, faces
    (flows, _), (face_flows, _) = measured
    left, of_faces = _kept_off(measured[0], half_space), _kept_off(measured[1], half_space)
    place, closing, lead = _nearest_place(echoes, normal, edge, near), 0.0, 0.0
    coming = near if rests else (place[0], place[1])
    first = normal[0] * place[0] + normal[1] * place[1]
    if rests:
        if len(left) < AGREEING:
            return 0.0, 0.0, coming
        place = _nearest_flow(flows, left, normal)
    for face in range(1 if rests else 0, FACES):
        beside, rest = flows_beside(flows, left, place, normal), left
        if face == 0 or len(beside) >= AGREEING:
            near_faces = flows_beside(face_flows, of_faces, place, normal) if len(of_faces) > 0 else of_faces
            track = track_at(tracks, place, (flows, beside), (face_flows, near_faces), time)
            needed = max(AGREEING, (len(beside) + 1) // 2)
            if face == 0 or count_flows_in_gate(track, (flows, beside), time) >= needed:
                speed, behind = closing_speed(track, normal), normal[0] * place[0] + normal[1] * place[1] - first
                slowed = speed - 0.25 * max(behind, 0.0) / reaction
                if slowed > closing:
                    closing, coming = slowed, (place[0], place[1])
                lead = max(lead, reaction * speed - max(behind, 0.0))
            if len(beside) > 0:  # else the track tells of nothing
                rest = flows_outside_gate(track, (flows, left), time)
        left = rest if len(rest) < len(left) else _without(left, beside)
        if len(left) < AGREEING:
            break
        place = _nearest_flow(flows, left, normal)
    return closing, lead, coming


@kernel
def _kept_off(measured, half_space):
    """Return which flows are of what a half-space keeps off, within `REACH` of its nearest place."""
    (flows, count), (normal, edge, near), size = measured, half_space, 0
    chosen = np.empty(count, np.int64)
    for i in range(count):
        dx, dy = flows.x[i] - near[0], flows.y[i] - near[1]
        if dx * dx + dy * dy <= REACH * REACH and normal[0] * flows.x[i] + normal[1] * flows.y[i] >= edge:
            chosen[size] = i
            size += 1
    return chosen[:size]


@kernel
def _nearest_flow(flows, chosen, normal):
    """Return the place of the flow, of those chosen, that is nearest along a normal, with no deviation of its range."""
    best = chosen[0]
    for i in chosen:
        if normal[0] * (flows.x[i] - flows.x[best]) + normal[1] * (flows.y[i] - flows.y[best]) < 0.0:
            best = i
    return flows.x[best], flows.y[best], 0.0


@kernel
def _without(chosen, others):
    """Return those chosen that are not among the others; both ascend."""
    kept, size, k = np.empty(len(chosen), np.int64), 0, 0
    for i in chosen:
        while k < len(others) and others[k] < i:
            k += 1
        if k == len(others) or others[k] != i:
            kept[size] = i
            size += 1
    return kept[:size]


@kernel
def _nearest_place(echoes, normal, edge, near):
    """Return where the face of a half-space is nearest along its normal (x, y, its range's standard deviation) [m].

    Of the echoes beside `near` (2,), its place that is nearest to the robot's path: a half-space goes on for ever, its
    face does not. What is nearer than the `edge` [m] other half-spaces keep off. Where the scan has no echo there, that
    is `near` itself.
    """
    x, y, std, best = near[0], near[1], 0.0, math.inf
    for i in range(len(echoes.x)):
        if echoes.binds[i]:
            along = normal[0] * echoes.x[i] + normal[1] * echoes.y[i]
            if edge <= along < best:
                dx, dy = echoes.x[i] - near[0], echoes.y[i] - near[1]
                if dx * dx + dy * dy <= BESIDE * BESIDE:
                    x, y, std, best = echoes.x[i], echoes.y[i], math.sqrt(echoes.variance[i]), along
    return x, y, std
