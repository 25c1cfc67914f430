"""Which remembered points an echo takes the place of: those on its face, not those of a thin thing beside it."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import Echoes
from pbrg_mj.perception.points.memory import delete_stale, no_points
from pbrg_mj.perception.points.replaced import BESIDE, delete_replaced
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.raycast import Scene
from tests.seeing_points import estimator, scan, sensor

SCAN = 20
AT_REST = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.1)


def echoes_at(places: np.ndarray, std: float, joined: np.ndarray, binds: bool = True) -> Echoes:
    """Echoes at places (B, 2) of a robot at the origin."""
    count = len(places)
    along = places / np.linalg.norm(places, axis=1, keepdims=True)
    of_scan = np.full(count, True), places[:, 0].copy(), places[:, 1].copy(), np.full(count, std**2)
    poses = np.full(count, 0.5 * std), np.zeros(count)
    towards = along[:, 0].copy(), along[:, 1].copy()
    return Echoes(*of_scan, *poses, *towards, np.full(count, binds), np.full(count, np.inf), np.zeros(count), joined)


def stays(place: np.ndarray, seen: Echoes, age: int = 6, std: float = 0.005) -> bool:
    """Whether a point stays whose direction is that of the second echo."""
    points = no_points(1, 1)[0]
    points[0]["x"], points[0]["y"] = place
    points[0]["std"], points[0]["pose_std"], points[0]["scan"], points[0]["beam"] = std, std, SCAN - age, 1
    points[0]["live"] = points[0]["binds"] = True
    delete_replaced(points, SCAN, seen, AT_REST, estimator()[0].parameters)
    return bool(points[0]["live"])


def test_points_at_an_echo_or_between_it_and_the_next_on_its_face_are_replaced_and_no_others():
    """Beside 4,001 places of the segments, for any of the ways in which the three echoes are joined."""
    draws, told = np.random.default_rng(3), []
    for _ in range(1500):
        directions = np.array([-1.0, 0.0, 1.0]) * draws.uniform(0.02, 0.2)
        places = draws.uniform(0.5, 1.0, (3, 1)) * np.column_stack([np.cos(directions), np.sin(directions)])
        before, after = draws.integers(0, 2, 2).astype(bool)
        joined = np.array([[-1, -1], [0 if before else -1, 2 if after else -1], [-1, -1]])
        std, own = draws.uniform(0.001, 0.02, 2)
        angle = draws.uniform(-1.0, 1.0) * abs(directions[0])
        place = draws.uniform(0.4, 1.1) * np.array([np.cos(angle), np.sin(angle)])
        other = joined[1, int(angle > 0.0)]
        ends = places[1], places[other if other >= 0 else 1]
        segment = ends[0] + np.linspace(0.0, 1.0, 4001)[:, None] * (ends[1] - ends[0])
        distance = np.linalg.norm(segment - place, axis=1).min()
        allowed = 3.0 * np.sqrt(1.25 * std**2 + 2.0 * own**2) + BESIDE
        if abs(distance - allowed) > 1e-3:
            told.append(distance > allowed)
            assert stays(place, echoes_at(places, std, joined), std=own) == told[-1]
    assert 300 < sum(told) < len(told) - 300


@pytest.mark.parametrize(("binds", "age", "left"), [(True, 6, False), (False, 6, True), (True, 5, True)])
def test_an_echo_that_does_not_bind_replaces_nothing_and_recent_points_are_kept(binds: bool, age: int, left: bool):
    places = np.array([[1.0, -0.1], [1.0, 0.0], [1.0, 0.1]])
    assert stays(places[1], echoes_at(places, 0.005, np.full((3, 2), -1), binds), age) == left


def test_the_cone_of_an_echo_is_all_of_its_place():
    """27 degrees wide: what is 0.2 m beside the middle of the view at 1 m may be what echoes."""
    places, joined = np.array([[1.0, -0.3], [1.0, 0.0], [1.0, 0.3]]), np.full((3, 2), -1)
    points = no_points(1, 1)[0]
    points[0]["x"], points[0]["y"], points[0]["live"], points[0]["binds"], points[0]["beam"] = 1.0, 0.2, True, True, 1
    for preset, left in (("tof_ring", True), ("tof_cones", False)):
        parameters = estimator(sensor(preset))[0].parameters
        delete_replaced(points, SCAN, echoes_at(places, 0.005, joined), AT_REST, parameters)
        assert points[0]["live"] == left


@pytest.mark.parametrize("behind", [False, True], ids=["open", "wall behind"])
@pytest.mark.parametrize("seed", range(4))
def test_a_thin_post_that_is_known_stays_so_while_its_robot_turns(behind: bool, seed: int):
    """Of 24 beams at most one meets it, in one scan of six; the next thing beside it is 15 degrees away."""
    made, given = estimator(sensor("tof_ring"))
    given = given.model_copy(update={"seed": 70 + seed})
    walls = ((1.4, -4.0, 1.4, 4.0),) if behind else ()
    scene, nearest, kept = Scene(walls, ((0.7, 0.0, 0.02),)), np.array([0.68, 0.0]), []
    memory, period = made.init(), 1.0 / given.sensors.beams.rate_hz
    for frame in range(150):
        time = frame * period
        pose = np.array([[0.0, 0.0, 0.4 * np.sin(1.5 * time)]])
        known, memory = made.step_towards(scan(given, scene, pose, frame), time, memory, np.array([[2.0, 0.0]]))
        kept.append(bool((known.G[0] @ nearest > known.h[0])[known.active[0]].any()))
    first = kept.index(True)
    assert first < 75 and all(kept[first:])


def test_what_a_beam_meets_again_has_that_beam_and_what_it_passes_has_none():
    points = no_points(1, 2)[0]
    points["x"], points["y"], points["std"], points["time"], points["scan"] = [1.0, 0.5], 0.0, 0.005, 0.9, SCAN - 6
    points["live"] = points["binds"] = True
    parameters = estimator()[0].parameters
    delete_stale(points, SCAN, SeenBeams(np.full(72, 1.0), parameters.directions), AT_REST, parameters)
    ahead = int(np.argmax(parameters.directions[:, 0]))
    assert points["beam"].tolist() == [ahead, -1] and points["live"].all()
