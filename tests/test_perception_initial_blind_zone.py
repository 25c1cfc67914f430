"""What a robot starts beside, nearer than beams tell: its first scan has echoes of it on one side alone."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.estimator import PointMemory
from tests.perceiving import box
from tests.raycast import Scene
from tests.seeing_points import PERIOD, estimator, scan, sensor

AWAY, END = 0.1, 0.08  # [m] of the wall's face from the robot, and how far it reaches to the right: 0.128 m away
PRESETS = ["lidar", "lds_02"]
SCANS = 40


def wall(turn: float) -> Scene:
    """A thin wall ahead and to the left; its right end is nearer than beams tell."""
    return Scene(((AWAY, -END, AWAY, 1.0), (AWAY + 0.035, -END, AWAY + 0.035, 1.0))).moved(0.0, 0.0, turn)


def turned(points: np.ndarray, turn: float) -> np.ndarray:
    cos, sin = np.cos(turn), np.sin(turn)
    return points @ np.array([[cos, sin], [-sin, cos]])


def after_first_scan(preset: str, scene: Scene, frame: int):
    made, given = estimator(sensor(preset), slots=8)
    readings = scan(given, scene, np.zeros((1, 3)), frame)
    known, memory = made.step(readings, 0.0, made.init())
    return made, known, memory


def places(memory: PointMemory) -> np.ndarray:
    points = memory.points[0]
    live = points[points["live"] & points["binds"]]
    return np.column_stack([live["x"], live["y"]])


def unseen(memory: PointMemory, shortest: float) -> np.ndarray:
    """Return the places of a robot at the origin that are nearer than beams tell, and not for their noise."""
    found = places(memory)
    return found[np.linalg.norm(found, axis=1) < 0.97 * shortest]


@pytest.mark.parametrize("turn", [0.0, 0.9, -2.5])
@pytest.mark.parametrize("preset", PRESETS)
def test_the_end_of_a_wall_that_no_beam_tells_of_is_kept_off(preset: str, turn: float) -> None:
    face = turned(np.column_stack([np.full(50, AWAY), np.linspace(-END, 0.5, 50)]), turn)
    kept = 0
    for frame in range(SCANS):
        made, known, _ = after_first_scan(preset, wall(turn), frame)
        G, h = known.G[0, known.active[0]], known.h[0, known.active[0]]
        ahead = (face @ G.T - h).max(axis=1) - made.parameters.clearance
        kept += bool((ahead > -0.01).all())
    assert kept >= 0.95 * SCANS


@pytest.mark.parametrize("preset", PRESETS)
def test_places_are_on_the_line_of_the_face_and_within_the_shortest_range(preset: str) -> None:
    enough = 0
    for frame in range(SCANS):
        made, _, memory = after_first_scan(preset, wall(0.4), frame)
        told = turned(unseen(memory, made.parameters.range_min), -0.4)
        enough += len(told) > 20
        np.testing.assert_allclose(told[:, 0], AWAY, atol=0.02)
        assert np.abs(told[:, 1]).max(initial=0.0) < np.sqrt(0.18**2 - AWAY**2)
    assert enough >= 0.95 * SCANS


@pytest.mark.parametrize("preset", PRESETS)
def test_the_faces_of_a_corner_go_on_each_along_its_own_line(preset: str) -> None:
    """The corner of a box is 0.1 m ahead: both faces go on behind it, and no place is in front of it."""
    corner = box(0.1 + 0.4 * np.sqrt(2.0), 0.0, 0.8, angle=np.pi / 4.0)
    for frame in range(SCANS):
        made, _, memory = after_first_scan(preset, corner, frame)
        told = unseen(memory, made.parameters.range_min)
        assert (told[:, 0] - np.abs(told[:, 1])).max(initial=0.0) < 0.13
        assert np.all(told[:, 0] + np.abs(told[:, 1]) > 0.07)


@pytest.mark.parametrize("preset", [*PRESETS, "tof_cones"])
def test_nothing_goes_on_where_beams_tell_of_all(preset: str) -> None:
    _, _, memory = after_first_scan(preset, wall(0.0).moved(0.2, 0.0, 0.0), 0)
    assert np.linalg.norm(places(memory), axis=1).min() > 0.25


@pytest.mark.parametrize("preset", PRESETS)
def test_what_is_not_there_is_forgotten_once_beams_pass(preset: str) -> None:
    """Beyond its end the wall was taken to go on; from 0.3 m away beams go by there to what came."""
    behind = Scene(((1.0, -2.0, 1.0, 2.0),))
    scene = Scene(wall(0.0).segments + behind.segments)
    for frame in range(10):
        made, given = estimator(sensor(preset), slots=8)
        _, memory = made.step(scan(given, wall(0.0), np.zeros((1, 3)), frame), 0.0, made.init())
        found = places(memory)
        assert found[found[:, 0] < 0.5, 1].min() < -END - 0.01
        for k in range(1, 7):
            pose = np.array([[-0.2, -0.1, 0.0]])
            _, memory = made.step(scan(given, scene, pose, 100 * frame + k), 4.0 * k * PERIOD, memory)
        found = places(memory)
        assert found[found[:, 0] < 0.5, 1].min() > -END - 0.03
