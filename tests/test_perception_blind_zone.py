"""Faces that move and go on nearer than beams tell."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.blind_zone import add_blind_zone_faces
from pbrg_mj.perception.points.face_track import TRACK
from pbrg_mj.perception.points.scan_faces import scan_and_faces
from tests.perceiving import HAND, box
from tests.seeing_points import estimator, sensor
from tests.test_perception_face_flow import looked_at

SLOTS = 3
HalfSpaceArrays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def nothing() -> HalfSpaceArrays:
    return np.zeros((SLOTS, 2)), np.zeros(SLOTS), np.zeros(SLOTS, bool), np.zeros((SLOTS, 2)), np.zeros((SLOTS, 8))


def tracks_at(x: float, y: float, moves: bool = True) -> np.ndarray:
    tracks = np.zeros(4, TRACK)
    tracks[1]["x"], tracks[1]["y"], tracks[1]["live"], tracks[1]["moves"] = x, y, True, moves
    return tracks


def found(preset: str, distance: float, turn: float = 0.0, *, moves: bool = True, half_spaces=None, frame: int = 1):
    """Half-spaces added for a box of 0.6 m whose face is so far from a robot at the origin."""
    made, given = estimator(sensor(preset))
    centre = (distance + 0.3) * np.array([np.cos(turn), np.sin(turn)])
    seen, ends, pose = looked_at(made, given, box(*centre, 0.6, angle=turn), frame)
    added = half_spaces or nothing()
    tracks = tracks_at(*(0.15 * np.array([np.cos(turn), np.sin(turn)])), moves=moves)
    _, faces = scan_and_faces(seen, ends, pose, made.parameters)
    add_blind_zone_faces(seen, faces, tracks, pose, made.parameters, added)
    return added, made.parameters


@pytest.mark.parametrize("turn", [0.0, 0.8, 2.5])
@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
def test_a_face_that_moves_goes_on_where_beams_are_silent(preset: str, turn: float) -> None:
    """Its middle is nearer than beams tell: the half-space is that of its line, and nearest where that is nearest."""
    along, hand = np.array([np.cos(turn), np.sin(turn)]), np.array([HAND, 0.0])
    foot, scans, from_foot = hand + (0.1 - hand @ along) * along, 0, []
    for frame in range(50):
        (G, h, active, nearest, _), numbers = found(preset, 0.1, turn, frame=frame)
        scans += int(active.any())
        for k in np.flatnonzero(active):
            assert G[k] @ along > np.cos(np.radians(10.0))
            assert h[k] == pytest.approx(0.1 - numbers.clearance, abs=0.02)
            from_foot.append(np.linalg.norm(nearest[k] - foot))
    assert scans > 42
    assert np.median(from_foot) < 0.01


@pytest.mark.parametrize(
    ("distance", "moves", "preset"), [(0.25, True, "lidar"), (0.1, False, "lidar"), (0.1, True, "tof_cones")]
)
def test_nothing_is_added_for_what_is_seen_or_rests_or_where_beams_are_cones(
    distance: float, moves: bool, preset: str
) -> None:
    (_, _, active, _, _), _ = found(preset, distance, moves=moves)
    assert not active.any()


@pytest.mark.parametrize("turn", [0.2, 0.0, -0.2])
def test_a_corner_nearer_than_beams_tell_has_the_half_space_of_one_face(turn: float) -> None:
    """Both lines go on; that which the robot is farther ahead of keeps off all of the box."""
    made, given = estimator(sensor("lidar"))
    corner, angle = np.array([0.1, 0.0]), np.pi / 4 + turn
    centre = corner + 0.3 * np.sqrt(2.0) * np.array([np.cos(turn), np.sin(turn)])
    seen, ends, pose = looked_at(made, given, box(*centre, 0.6, angle=angle), 1)
    G, h, active, nearest, lines = nothing()
    _, faces = scan_and_faces(seen, ends, pose, made.parameters)
    add_blind_zone_faces(seen, faces, tracks_at(0.15, 0.0), pose, made.parameters, (G, h, active, nearest, lines))
    assert active.tolist() == [True, False, False]
    angles = np.array([angle, angle - np.pi / 2])  # from the robot to the faces, along their normals
    ahead = [np.array([np.cos(one), np.sin(one)]) @ (corner - [HAND, 0.0]) for one in angles]
    likely = angles if turn == 0.0 else angles[[np.argmax(ahead)]]
    assert min(abs(np.arctan2(G[0, 1], G[0, 0]) - likely)) < np.radians(6.0)
    assert G[0] @ corner - h[0] == pytest.approx(made.parameters.clearance, abs=0.015)


def test_a_half_space_that_keeps_it_off_already_is_enough_and_no_slot_is_taken_from_another() -> None:
    for taken, h0, normal in ((1, -0.01, [1.0, 0.0]), (SLOTS, 1.0, [0.0, 1.0])):
        before = nothing()
        before[0][:taken], before[1][:taken], before[2][:taken] = normal, h0, True
        (G, h, active, _, _), _ = found("lidar", 0.1, half_spaces=before)
        assert active.sum() == taken
        np.testing.assert_array_equal(h[:taken], h0)
        np.testing.assert_array_equal(G[:taken], np.tile(normal, (taken, 1)))
    before = nothing()
    before[0][0], before[1][0], before[2][0] = [1.0, 0.0], 0.05, True  # the same, 5 cm farther off
    (_, h, active, _, _), _ = found("lidar", 0.1, half_spaces=before)
    assert active.sum() == 2
    assert h[1] < 0.02
