"""What half-spaces from points leave to a hand point: nothing near a solid, of any shape, and nothing unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.sight import SightLimit
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.registry import governor
from pbrg_mj.perception.points import known_free
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import box, rows, together
from tests.raycast import Scene, cast
from tests.seeing_points import PERIOD, ROBOT, estimator, scan, sensor

SPEED = 0.2  # [m/s]


def polygon(*corners: tuple[float, float]) -> Scene:
    return Scene(tuple((a[0], a[1], b[0], b[1]) for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)))


L_SHAPE = polygon((0, 0), (1.2, 0), (1.2, 0.4), (0.4, 0.4), (0.4, 1.2), (0, 1.2))
U_SHAPE = polygon((0, 0), (1.5, 0), (1.5, 1.0), (1.2, 1.0), (1.2, 0.3), (0.3, 0.3), (0.3, 1.0), (0, 1.0))
CROSS = together(box(0.5, 0.5, 1.2, 0.3), box(0.5, 0.5, 0.3, 1.2))
ROOM = polygon((-1.5, -1.5), (2.0, -1.5), (2.0, 0.5), (0.5, 0.5), (0.5, 2.0), (-1.5, 2.0))


def clutter(seed: int) -> Scene:
    """Twenty boxes of 0.2 to 0.5 m, none within 0.4 m of the origin."""
    rng, boxes = np.random.default_rng([seed, 11]), []
    while len(boxes) < 20:
        x, y = rng.uniform(-2.5, 2.5, 2)
        if np.hypot(x, y) > 0.4 + 0.36:
            boxes.append(
                box(x, y, float(rng.uniform(0.2, 0.5)), float(rng.uniform(0.2, 0.5)), angle=rng.uniform(0, np.pi))
            )
    return together(*boxes)


def around(shape: Scene, seed: int) -> Scene:
    """The shape at a random place and angle, its nearest wall 0.3 m from the origin or more."""
    rng = np.random.default_rng([seed, 12])
    while True:
        placed = shape.moved(*rng.uniform([-1.5, -1.5, 0.0], [1.5, 1.5, 2 * np.pi]))
        if distances(placed, np.zeros((1, 2)))[0] > 0.3:
            return placed


def distances(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Distance of every point (k, 2) from the nearest segment."""
    segments = np.array(scene.segments)
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    rest = points[:, None] - start
    share = np.clip(np.sum(rest * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.linalg.norm(rest - share[..., None] * along, axis=2).min(axis=1)


def drive(scene: Scene, seed: int, preset: str, slots: int = 8, unknown: str = "closed", scans: int = 10):
    """Drive from the origin in some direction until a wall is 0.15 m away; yield pose, G, h from the third scan."""
    made, given = estimator(sensor(preset), slots=slots, unknown=unknown)
    given = given.model_copy(update={"seed": seed})
    rng = np.random.default_rng([seed, 13])
    course, pose, memory = rng.uniform(0, 2 * np.pi), np.array([0.0, 0.0, rng.uniform(0, 2 * np.pi)]), made.init()
    way = np.array([np.cos(course), np.sin(course)])
    for frame in range(scans):
        known, memory = made.step_towards(
            scan(given, scene, pose[None], frame), frame * PERIOD, memory, 2.0 * way[None]
        )
        if frame >= 2:
            yield pose, *rows(known)
        ahead = pose[:2] + SPEED * PERIOD * way
        if distances(scene, ahead[None])[0] > 0.15:
            pose = np.array([*ahead, pose[2] + 0.1])


def admitted(pose: np.ndarray, G: np.ndarray, h: np.ndarray, seed: int) -> np.ndarray:
    grid = pose[:2] + np.random.default_rng(seed).uniform(-2.0, 2.0, (3000, 2))
    return grid[np.all(grid @ G.T <= h, axis=1)]


@pytest.mark.parametrize("preset", ["default", "robotarium", "tof_ring", "lidar"])
def test_no_admitted_point_is_nearer_to_a_solid_than_the_clearance(preset: str) -> None:
    """Of any shape, hidden or not, by more than 1 cm: in none of these scans (allowed are 0.3 %)."""
    scenes = [around(shape, seed) for seed in range(4) for shape in (L_SHAPE, U_SHAPE, CROSS)] + [ROOM]
    if preset != "tof_ring":  # whose 24 beams pass a box of 0.2 m on both sides
        scenes += [clutter(seed) for seed in range(3)]
    checked = 0
    for seed, scene in enumerate(scenes):
        for pose, G, h in drive(scene, seed, preset, slots=4 + seed % 5):
            points = admitted(pose, G, h, seed)
            checked += len(points) > 0
            assert not len(points) or distances(scene, points).min() > ROBOT.clearance - 0.01
    assert checked >= 80


@pytest.mark.parametrize("unknown", ["free", "closed"])
def test_a_box_around_the_way_leaves_nothing_out(unknown: str) -> None:
    """All that was seen is behind a half-space, with four slots, too; with six the robot is before all of them."""
    for slots, seed in ((4, 0), (4, 1), (6, 2), (6, 3)):
        scene = clutter(seed)
        for pose, G, h in drive(scene, seed, "default", slots=slots, unknown=unknown, scans=5):
            angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)
            directions = np.column_stack([np.cos(angles), np.sin(angles)])
            for direction in directions:
                first = _first_hit(scene, pose[:2], direction)
                assert np.isinf(first) or np.any(G @ (pose[:2] + first * direction) > h)
            hand = pose[:2] + ROBOT.hand_offset * np.array([np.cos(pose[2]), np.sin(pose[2])])
            assert slots == 4 or np.all(G @ hand <= h) or distances(scene, hand[None])[0] < 0.25


def _first_hit(scene: Scene, origin: np.ndarray, direction: np.ndarray) -> float:
    pose = np.array([*origin, np.arctan2(direction[1], direction[0])])
    found = cast(scene, pose, 4)[0]
    return float(found) if np.isfinite(found) else np.inf


def test_nothing_is_admitted_beyond_the_range_nor_behind_a_thing() -> None:
    short = {"beams": {"range_max": 1.2}}
    made, given = estimator(short, slots=8, unknown="closed")
    hidden, known, memory = box(0.7, 0.0, 0.3), None, made.init()
    for frame in range(3):
        known, memory = made.step_towards(scan(given, hidden, np.zeros((1, 3)), frame), frame * PERIOD, memory, None)
    assert known is not None
    points = admitted(np.zeros(3), *rows(known), seed=1)
    assert np.hypot(*points.T).max() < 1.2 - ROBOT.clearance + 0.02
    behind = points[(points[:, 0] > 0.5) & (np.abs(points[:, 1]) < 0.1)]
    assert len(points) > 100
    assert not len(behind)


def test_a_pane_is_closed_under_strict_alone() -> None:
    """Two walls and 0.8 m between them from which no echo comes: a pane, or an opening to nothing within reach."""
    gap = Scene(((1.5, -4.0, 1.5, -0.4), (1.5, 0.4, 1.5, 4.0), (-1.0, -4.0, -1.0, 4.0)))
    for unknown, passes in (("free", True), ("closed", True), ("strict", False)):
        made, given = estimator(slots=8, unknown=unknown)
        known, memory = None, made.init()
        for frame in range(3):
            one = scan(given, gap, np.zeros((1, 3)), frame)
            known, memory = made.step_towards(one, frame * PERIOD, memory, np.array([[3.0, 0.0]]))
        assert known is not None
        G, h = rows(known)
        assert bool(np.all(h >= G @ [2.0, 0.0])) == passes
        assert np.all(h >= G @ [1.0, 0.0])


@pytest.mark.parametrize("unknown", ["free", "closed", "strict"])
@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
def test_a_wall_nearer_than_beams_tell_is_not_entered(preset: str, unknown: str) -> None:
    """Its robot starts beside it: it is seen on both sides of what no beam ever saw, wider than the clearance."""
    made, given = estimator(sensor(preset), slots=8, unknown=unknown)
    beams, small = given.sensors.beams, made.parameters._replace(clearance=0.06)
    made = replace(made, parameters=small)
    for seed, distance in enumerate(np.linspace(0.6 * beams.range_min, 0.95 * beams.range_min, 8)):
        wall = Scene(((-3.0, distance, 3.0, distance),))
        heading = np.random.default_rng(seed).uniform(0, 2 * np.pi)
        pose, memory, known = np.array([[0.0, 0.0, heading]]), made.init(), None
        for frame in range(3):
            one = scan(given.model_copy(update={"seed": seed}), wall, pose, frame)
            known, memory = made.step_towards(one, frame * PERIOD, memory, np.array([[0.0, 1.0]]))
        G, h = rows(known)
        points = np.column_stack([np.linspace(-0.2, 0.2, 41), np.full(41, distance - 0.05)])
        assert not np.any(np.all(points @ G.T <= h, axis=1))


def test_silence_between_things_on_either_side_stays_free() -> None:
    """The way between two posts that are at the shortest range, 150 deg apart."""
    made, given = estimator(sensor("lds_02"), slots=8)
    away = 0.17 * np.array([np.cos(np.radians(75.0)), np.sin(np.radians(75.0))])
    posts = together(box(*away, 0.02), box(away[0], -away[1], 0.02))
    known, memory = None, made.init()
    for frame in range(3):
        one = scan(given, posts, np.zeros((1, 3)), frame)
        known, memory = made.step_towards(one, frame * PERIOD, memory, np.array([[1.0, 0.0]]))
    G, h = rows(known)
    assert np.all(h >= G @ [0.8, 0.0])


def test_a_blind_side_leaves_room_to_turn() -> None:
    made, given = estimator({"beams": {"sweep_deg": 180.0}}, slots=8, unknown="closed")
    beams, noise = made.parameters.directions, np.random.default_rng(3)
    ranges = np.full((1, len(beams)), np.nan)
    known, memory = None, made.init()
    for frame in range(2):
        pose = 1e-3 * noise.normal(size=(1, 3))
        one = Readings(pose, ranges, True, 3 * frame, frame)
        known, memory = made.step_towards(one, frame * PERIOD, memory, np.array([[0.0, 1.0]]))
    assert known is not None
    G, h = rows(known)
    behind = np.array([0.0, -1.0])  # the beams go from the heading to the left and on to the back
    for turn in (np.array([1.0, 0.0]), np.array([-1.0, 0.0]), np.array([0.0, 1.0]), behind):
        assert np.all(G @ (0.5 * ROBOT.hand_offset * turn) <= h)
    assert np.any(G @ (0.2 * behind) > h)
    assert np.all(h >= G @ [0.0, 2.0])
    assert given.sensors.beams.sweep_deg == 180.0


def test_half_spaces_replace_the_rows_of_sight() -> None:
    keys = ["governor.kind=certified", "estimator.source=points", "sensors.beams.range_max=1.2"]
    for unknown, expected in (("free", 1), ("closed", 0), ("strict", 0)):
        made = governor(load_scenario("obstacles/box", [*keys, f"estimator.unknown={unknown}"]).scenario)
        assert isinstance(made, CertifiedGovernor)
        assert sum(isinstance(limit, SightLimit) for limit in made.limits) == expected


def test_points_bring_their_scope_and_slots() -> None:
    one = load_scenario("obstacles/box", ["estimator.source=points"]).scenario.estimator
    assert (one.scope, one.half_spaces_per_robot) == ("own", 8)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match=r"estimator\.unknown.*points"):
        load_scenario("obstacles/box", ["estimator.unknown=closed"])
    with pytest.raises(InputError, match=r"half_spaces_per_robot.*4 or more"):
        load_scenario("obstacles/box", ["estimator.source=points", "estimator.half_spaces_per_robot=3"])


def test_a_chord_behind_the_robot_makes_no_place() -> None:
    """Two echoes so far apart that their line meets a silent beam backwards: nothing of the edge is left unwritten."""
    chords, angles = np.array([-0.1, 0.2, 0.0]), np.array([0.0, 0.5, 1.0])
    edge = known_free._edge_at_chords(chords, angles, ScanPose(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(edge.x, [1.0 + 0.2 * np.cos(0.5)])
    np.testing.assert_allclose(edge.y, [0.2 * np.sin(0.5)])
