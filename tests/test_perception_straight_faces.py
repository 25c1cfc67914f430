"""Straight faces among points: where the line is, what is none, and whom it binds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

import pbrg_mj as pbrg
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.known_free import Edge
from pbrg_mj.perception.points.lines import is_on_line, line_at, no_lines
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.obstacle_points import ObstaclePoints
from pbrg_mj.perception.points.past_scan import store_scan
from pbrg_mj.perception.points.separate import separate
from pbrg_mj.perception.points.straight_face import straight_face
from pbrg_mj.perception.points.unexpected import EXPECTED, UNEXPECTED, unexpected_echoes
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.perceiving import rows
from tests.raycast import Scene, cast
from tests.seeing_points import PERIOD, ROBOT, estimator, scan, sensor
from tests.test_perception_motion import box, together

WALL = Scene(((0.6, -6.0, 0.6, 6.0),))
PATH = np.zeros(4)  # a hand point that stays at the origin


def face_of(xy: np.ndarray, std: float, pose_std: float, scans: np.ndarray) -> tuple[ObstaclePoints, int, np.ndarray]:
    """Return a window of echoes at places (k, 2) [m], each of one of the `scans` (k,), 0.1 s apart."""
    count = len(xy)
    points = no_points(1, count)[0]
    for name, values in (("x", xy[:, 0]), ("y", xy[:, 1]), ("std", std), ("pose_std", pose_std)):
        points[name] = values
    points["scan"], points["time"] = scans, 0.1 * scans
    points["live"], points["binds"], points["confirmed_within"] = True, True, np.inf
    far = np.hypot(*xy.T)
    points["ux"], points["uy"] = (xy / far[:, None]).T
    x, y = points["x"].copy(), points["y"].copy()
    window = ObstaclePoints(x, y, points["std"].copy(), np.full(count, 0.1), np.zeros(count), np.arange(count), points)
    return window, count, PATH


def places(rng: np.random.Generator, angle: float, std: float, pose_std: float, speed: float = 0.0, bend: float = 0.0):
    """Return a `face_of` 120 echoes of a face 0.6 m away, and its normal; `speed` [m/s] is towards the robot."""
    normal, along = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    s, scans = rng.uniform(-0.7, 0.7, 120), np.repeat(np.arange(1, 7), 20)
    true = (0.6 + speed * 0.1 * (6 - scans) + bend * s**2)[:, None] * normal + s[:, None] * along
    beam = true / np.hypot(*true.T)[:, None]
    poses = pose_std * rng.standard_normal((7, 2))
    return face_of(true + std * rng.standard_normal((120, 1)) * beam + poses[scans], std, pose_std, scans), normal


def hull_normal(normal: np.ndarray, rng: np.random.Generator) -> tuple[float, float]:
    """Return the normal turned by up to 10 deg, as that of a hull is."""
    turn = rng.uniform(-0.17, 0.17)
    return tuple(np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ normal)


def test_the_line_is_the_wall_s_with_the_deviation_that_it_tells():
    """500 planted walls: behind the wall errors over the deviation told are those of a standard normal, or less.

    Ahead of it they are larger, by what noise may hide.
    """
    made, _ = estimator()
    rng, errors, turned = np.random.default_rng(5), [], []
    for _ in range(500):
        face, normal = places(rng, rng.uniform(-3.0, 3.0), 0.005, 0.002)
        line = straight_face(face, hull_normal(normal, rng), made.parameters)
        assert line.found
        turned.append(np.arctan2(line.gx * normal[1] - line.gy * normal[0], line.gx * normal[0] + line.gy * normal[1]))
        errors.append((line.offset - 0.6) / line.std)  # seen from abreast, a turned line is as far
    assert np.std(errors) < 1.3
    assert -1.2 < np.mean(errors) < 0.0  # it allows for what noise may hide
    assert np.max(errors) < 3.5
    assert all(np.mean(np.array(errors) > deviations) <= ndtr(-deviations) for deviations in (0.5, 1.0, 2.0))
    assert np.std(turned) < 0.004


@pytest.mark.parametrize(("speed", "bend"), [(0.1, 0.0), (0.3, 0.0), (0.0, 0.2), (0.0, -0.2)])
def test_what_comes_nearer_or_is_bent_is_no_line(speed: float, bend: float):
    made, _ = estimator()
    rng = np.random.default_rng(6)
    for _ in range(50):
        face, normal = places(rng, 0.3, 0.005, 0.001, speed, bend)
        assert not straight_face(face, hull_normal(normal, rng), made.parameters).found


def test_a_face_that_comes_at_a_tenth_of_a_metre_a_second_is_no_line():
    """No place is off the line of all by more than noise explains; the means of the scans are."""
    made, _ = estimator()
    rng = np.random.default_rng(9)
    for _ in range(50):
        face, normal = places(rng, 0.3, 0.008, 0.001, speed=0.1)
        assert not straight_face(face, hull_normal(normal, rng), made.parameters).found


@pytest.mark.parametrize(("ahead", "again"), [(0.036, False), (0.3, False), (0.036, True), (0.3, True)])
def test_one_echo_ahead_of_a_line_binds_no_more_until_another_scan_has_it(ahead: float, again: bool):
    """Of a sensor with outliers alone."""
    made, _ = estimator(sensor("lidar"))
    exact, _ = estimator()
    rng = np.random.default_rng(10)
    (window, count, path), _ = places(rng, 0.0, 0.004, 0.0)
    for i in (0, 119) if again else (0,):  # of the first and of the last scan
        window.x[i], window.y[i] = 0.6 - ahead, 0.1
        window.memory["x"][i], window.memory["y"][i] = 0.6 - ahead, 0.1
    assert not straight_face((window, count, path), (1.0, 0.0), exact.parameters).found
    assert window.memory["binds"].all()
    line = straight_face((window, count, path), (1.0, 0.0), made.parameters)
    assert line.found != again
    assert window.memory["binds"][0] == again
    assert window.memory["binds"][1:].all()


@pytest.mark.parametrize("ahead", [0.1, 0.3])
def test_an_echo_that_one_half_as_far_ahead_confirmed_is_no_outlier_and_one_that_the_wall_confirmed_is(ahead: float):
    """What confirmed it is no longer known."""
    made, rng = estimator(sensor("lidar"))[0].parameters, np.random.default_rng(10)
    for within in (0.4 * ahead, 0.6 * ahead):
        (window, count, path), _ = places(rng, 0.0, 0.004, 0.0)
        window.x[0], window.y[0] = 0.6 - ahead, 0.1
        window.memory["x"][0], window.memory["y"][0], window.memory["confirmed_within"][0] = 0.6 - ahead, 0.1, within
        outlier = straight_face((window, count, path), (1.0, 0.0), made).found
        assert outlier == (within > 0.5 * ahead) and window.memory["binds"][0] != outlier


@pytest.mark.parametrize(("echoes", "deviations", "found"), [(1, 5.5, True), (1, 7.0, False), (5, 5.5, False)])
def test_one_echo_ahead_that_noise_explains_makes_a_wall_no_less_a_line(echoes: int, deviations: float, found: bool):
    """Five of them side by side are no noise. In 1 of 50 faces another one beside it is ahead by noise."""
    made, _ = estimator()
    rng, std, lines = np.random.default_rng(12), 0.004, 0
    for _ in range(50):
        (window, count, path), _ = places(rng, 0.0, std, 0.0)
        ahead = np.argsort(np.abs(window.y - 0.1))[:echoes]  # of 120 on 1.4 m
        window.x[ahead] = 0.6 - deviations * std * np.cos(np.arctan2(window.y[ahead], 0.6))
        window.memory["x"][:] = window.x
        line = straight_face((window, count, path), (1.0, 0.0), made.parameters)
        lines += line.found
        assert not line.found or -2.0 * std <= line.offset - 0.6 <= 4.0 * line.std  # a part has 7 of 120
        assert not line.found or is_on_line(window, ahead[0], line, (-np.inf, np.inf))
    assert lines >= 45 if found else lines == 0


@pytest.mark.parametrize(("step", "since"), [(0.06, 0.0), (0.04, 0.3), (0.03, 0.6)])
def test_a_line_lets_in_no_step_that_noise_hides(step: float, since: float):
    """By more than 1 cm in 3 % of faces at most; 7 to 62 % where the line of all is what tells."""
    made, _ = estimator()
    rng, std, near = np.random.default_rng(3), 0.027, []
    for _ in range(300):
        s, scans = np.sort(rng.uniform(-0.7, 0.7, 60)), rng.integers(1, 7, 60)
        true = np.column_stack([0.6 - step * (s > since), s])
        noise = std * rng.standard_normal((60, 1)) * true / np.hypot(*true.T)[:, None]
        line = straight_face(face_of(true + noise, std, 0.001, scans), (1.0, 0.0), made.parameters)
        if line.found:
            near.append(line.offset - 3.0 * line.std - (0.6 - step))
    assert len(near) > 250
    assert np.mean(np.array(near) > 0.01) <= 0.03


def kept_off(points: np.ndarray, places: np.ndarray, made: PointEstimator) -> np.ndarray:
    """Return how far half-spaces of points, the first that of a line, keep the hand point from places (k, 2) [m]."""
    slots, nothing = 8, np.zeros(0)
    known, lines = HalfSpaces.empty(1, slots), no_lines(slots)
    written = known.G[0], known.h[0], known.active[0], np.empty((slots, 2)), lines
    separate((points, Edge(nothing, nothing, nothing)), np.zeros(2), np.zeros(2), made.parameters, written)
    assert line_at(lines, 0).found
    return np.where(known.active[0], places @ known.G[0].T - known.h[0], -np.inf).max(axis=1)


def test_what_is_beside_a_line_and_ahead_of_it_is_kept_off_whatever_the_echoes_of_the_line_tell_of_corners():
    """It is farther off than the window of the face; echoes of this that tell nothing of a corner are nearer still."""
    made, _ = estimator()
    rng = np.random.default_rng(8)
    wall = np.column_stack([np.full(120, 0.6), rng.uniform(-0.7, 0.7, 120)])
    thing = np.column_stack([np.full(6, 0.53), np.linspace(1.1, 1.3, 6)])
    points = face_of(np.concatenate([wall, thing]), 0.005, 0.001, rng.integers(1, 7, 126))[0].memory
    points["protrusion"][::10] = points["slack"][::10] = 0.2
    points["protrusion"][120:] = points["slack"][120:] = 0.06
    assert np.all(kept_off(points, thing, made) >= ROBOT.clearance)


def beside_wall(thing: np.ndarray, std: float) -> np.ndarray:
    """Return how far a hand point must stay from places (k, 2) [m] beyond the end of a wall that is 0.6 m away [m]."""
    made, _ = estimator(sensor("robotarium"))
    rng = np.random.default_rng(8)
    wall = np.column_stack([np.full(120, 0.6), rng.uniform(-0.7, 0.7, 120)])
    true = np.concatenate([wall, thing])
    noise = std * rng.standard_normal((len(true), 1)) * true / np.hypot(*true.T)[:, None]
    return kept_off(face_of(true + noise, std, 0.001, rng.integers(1, 7, len(true)))[0].memory, thing, made)


def test_a_line_goes_on_until_a_beam_passed_it():
    """A thing whose front is 6 cm ahead of the line, by two deviations, is kept off when echoes of its side tell."""
    front = np.column_stack([np.full(8, 0.54), np.linspace(1.3, 1.5, 8)])
    side = np.column_stack([np.linspace(0.57, 1.2, 14), np.full(14, 1.3)])
    assert beside_wall(front, 0.03).min() < ROBOT.clearance - 0.01  # may be the wall's, for all that its echoes tell
    assert beside_wall(np.concatenate([front, side]), 0.03).min() > ROBOT.clearance - 0.01


@pytest.mark.parametrize(("speed", "bend"), [(0.03, 0.0), (-0.03, 0.0), (0.0, 0.01), (0.0, -0.01)])
def test_a_line_of_what_is_hardly_bent_or_slow_is_not_behind_it(speed: float, bend: float):
    """By 1 cm once in 300 at most; both are within what passes for a line at rest."""
    made, _ = estimator()
    rng, ahead = np.random.default_rng(7), []
    for _ in range(300):
        face, normal = places(rng, 0.3, 0.005, 0.001, speed, bend)
        line = straight_face(face, hull_normal(normal, rng), made.parameters)
        if line.found:
            nearest = 0.6 + min(bend, 0.0) * 0.7**2
            ahead.append(line.offset - 3.0 * line.std - nearest)
    assert len(ahead) > 100
    assert np.count_nonzero(np.array(ahead) > 0.01) <= 1


def test_the_line_of_a_post_s_front_does_not_close_the_doorway():
    """In this world a team stood before the doorway for ever when half-spaces had the line's normal there."""
    scenario = pbrg.load("families/doorway", {"set_up": "recommended"}, seed=120111, duration=16.0).settings
    *_, last = Simulation.build(scenario).control_ticks()
    places = np.array(scenario.operator.reference) + np.array(scenario.team.formation)
    assert np.max(np.linalg.norm(last.hand_world - places, axis=1)) < 0.3


def known_at(scene: Scene, preset: str, frames: int, seed: int = 0, pose: np.ndarray | None = None):
    """Yield (estimator, half-spaces, memory) of a robot that rests at the origin, scan after scan."""
    made, given = estimator(sensor(preset))
    given, memory = given.model_copy(update={"seed": seed}), made.init()
    pose = np.zeros((1, 3)) if pose is None else pose
    for frame in range(frames):
        known, memory = made.step_towards(scan(given, scene, pose, frame), frame * PERIOD, memory, np.array([[3.0, 0]]))
        yield made, known, memory


@pytest.mark.parametrize("depth", [0.02, 0.05])
def test_a_board_on_the_wall_is_kept_off(depth: float):
    """0.2 m wide and flush: the half-space ends before it, not at the wall's line."""
    board = Scene(((0.6, -6.0, 0.6, -0.2), (0.6 - depth, -0.2, 0.6 - depth, 0.0), (0.6, 0.0, 0.6, 6.0)))
    for seed in range(20):
        *_, (_, known, _) = known_at(board, "default", 8, seed)
        G, h = rows(known)
        ahead = G[:, 0] > 0.9
        reach = np.min((h + 0.1 * G[:, 1])[ahead] / G[ahead, 0])  # abreast of the board
        assert reach < 0.6 - depth - ROBOT.clearance + 0.005


def test_half_spaces_at_a_wall_hardly_move_from_scan_to_scan():
    """By 2 mm (standard deviation), where the nearest of the echoes moves by four times that."""
    made, given = estimator()
    *_, last = known_at(WALL, "default", 60)
    ends = [
        np.min(known.h[0, known.G[0, :, 0] > 0.9] / known.G[0, known.G[0, :, 0] > 0.9, 0])
        for frame, (_, known, _) in enumerate(known_at(WALL, "default", 60))
        if frame >= 8
    ]
    assert np.std(ends) < 0.002
    assert 0.6 - made.parameters.clearance - 0.015 < np.mean(ends) < 0.6 - made.parameters.clearance
    assert not last[1].closing_speeds.any()
    assert given.sensors.beams.noise_std > 0.003


@pytest.mark.parametrize("preset", ["robotarium", "tof_ring", "lidar"])
def test_an_outlier_ahead_of_a_wall_waits_and_what_stays_there_does_not(preset: str):
    """One echo 15 cm ahead of the wall, in the tenth scan alone and from the thirteenth on."""
    made, given = estimator(sensor(preset))
    quiet = given.model_copy(update={"seed": 4})
    memory, pose = made.init(), np.zeros((1, 3))
    beam = int(np.argmax(made.parameters.directions[:, 0]))
    ends = []
    for frame in range(18):
        readings = scan(quiet, WALL, pose, frame)
        if frame == 9 or frame >= 12:
            readings.ranges[0, beam] = 0.45
        known, memory = made.step_towards(readings, frame * PERIOD, memory, np.array([[3.0, 0.0]]))
        ahead = known.G[0, :, 0] > 0.9
        ends.append(np.min((known.h[0] / np.where(ahead, known.G[0, :, 0], 1.0))[ahead]))
    assert min(ends[9:12]) > ends[8] - 0.03
    assert ends[-1] < 0.45 - made.parameters.clearance


def test_exact_ranges_make_neither_ends_nor_motion_of_a_wall():
    """Rounding alone tells whether a beam passes by the line of exact echoes."""
    made, given = estimator({"beams": {"preset": "ideal"}, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}})
    for turn in np.linspace(0.0, 0.08, 9):
        pose, memory = np.array([[0.0, 0.0, turn]]), made.init()
        for frame in range(8):
            known, memory = made.step_towards(scan(given, WALL, pose, frame), frame * PERIOD, memory, None)
            assert not known.closing_speeds.any()
        inner = np.abs(memory.past["y"][0]) < 0.5
        assert not (memory.past["ends"][0] * (inner & memory.past["external"][0])).any()


def test_a_body_that_tilts_is_still_a_team_mate_for_exact_beams():
    made, given = estimator(
        {"beams": {"preset": "ideal"}, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}},
        formation=((0.0, 0.0), (0.5, 0.0)),
    )
    poses, memory = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), made.init()
    wider = Scene((), ((0.5, 0.0, ROBOT.body_radius + 5e-4),))
    for frame in range(4):
        readings = scan(given, [wider, Scene(())], poses, frame)
        known, memory = made.step_towards(readings, frame * PERIOD, memory, None)
    assert np.isfinite(readings.ranges[0]).any()
    assert not known.active.any()


def unexpected(preset: str, change, poses: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Return which echoes of a second scan are unexpected, and their places; `change` made its ranges."""
    made, given = estimator(sensor(preset))
    made = PointEstimator(made.parameters._replace(range_std=1e-3, noise_ratio=0.0), made.robots, made.formation, 6)
    numbers, memory = made.parameters, made.init()
    ranges = []
    for k, y in enumerate(poses):
        clear = cast(WALL, np.array([0.0, y, 0.0]), given.sensors.beams.count, numbers.range_max)
        ranges.append(change(clear) if k else clear)
    for k, y in enumerate(poses):
        pose = ScanPose(0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1 * k, 0.1)
        beams, before = SeenBeams(ranges[k], numbers.directions), (memory.past[0], memory.past_poses[0])
        bodies = np.zeros((1, 1, 2)), 0
        echoes = add_scan(no_points(1, 2 * len(ranges[k]))[0], k + 1, beams, pose, bodies, before, numbers)
        if k:
            return unexpected_echoes(echoes, before, pose, numbers), np.column_stack([echoes.x, echoes.y])
        store_scan(memory.past[0, 0], memory.past_poses[0, :1], (echoes, beams), np.zeros(len(ranges[k]), int), pose)
    raise AssertionError


def test_an_echo_ahead_of_what_was_seen_before_is_unexpected():
    def one_ahead(ranges: np.ndarray) -> np.ndarray:
        ranges[[3, 10]] -= 0.06  # the second one at 70 deg to the wall's normal
        return ranges

    for y in (0.0, 0.02):
        found, _ = unexpected("robotarium", one_ahead, (0.0, y))
        np.testing.assert_array_equal(np.flatnonzero(found == UNEXPECTED), [3, 10])
        assert unexpected("robotarium", lambda ranges: ranges, (0.0, y))[0].max() == EXPECTED
        assert not unexpected("default", one_ahead, (0.0, y))[0].any()  # which has no outliers
    assert unexpected("robotarium", lambda ranges: ranges + 0.1)[0].max() == EXPECTED


def test_echoes_that_came_nearer_together_bind_at_once():
    """As those of a thing that drives; one by itself waits."""
    made, given = estimator(sensor("robotarium"))
    for beams, binds in (((0,), False), ((71, 0, 1), True)):
        memory = made.init()
        for frame in range(3):
            readings = scan(given.model_copy(update={"seed": 12}), WALL, np.zeros((1, 3)), frame)
            if frame == 2:
                readings.ranges[0, list(beams)] = 0.35
            _, memory = made.step_towards(readings, frame * PERIOD, memory, np.array([[3.0, 0.0]]))
        points = memory.points[0]
        there = points["live"] & (np.abs(points["x"] - 0.35) < 0.01) & (points["scan"] == 3)
        assert there.sum() == len(beams)
        assert (points["binds"][there] == binds).all()


def blind_team(scene: Scene, blind: np.ndarray) -> tuple[PointEstimator, np.ndarray]:
    """Return which half-spaces of robot 1 bind robot 2, which has no beams and stands at `blind` (3,)."""
    made, given = estimator({"beams": {"robots": [1]}}, formation=((0.0, 0.0), (0.0, 1.0)))
    memory, poses = made.init(), np.array([[0.0, 0.0, 0.0], blind])
    for frame in range(6):
        readings = scan(given, [scene, Scene(())], poses, frame)
        known, memory = made.step_towards(
            type(readings)(readings.body_pose, readings.ranges[:1], True, readings.pose_frame, readings.scan_frame),
            frame * PERIOD,
            memory,
            None,
        )
    return made, known.binds[0, :, 1] & known.active[0]


def test_a_long_wall_binds_the_robots_that_see_nothing():
    assert blind_team(WALL, np.array([0.0, 1.0, 0.0]))[1].any()
    assert not blind_team(WALL, np.array([0.9, 1.0, 0.0]))[1].any()  # on its other side, or beyond its end
    assert not blind_team(box(0.8, 0.0, 0.4), np.array([0.0, 1.0, 0.0]))[1].any()  # too short to tell of others' ways


def test_a_wall_beside_a_box_that_comes_is_at_rest_and_the_box_is_not():
    time = np.arange(0.0, 1.6, PERIOD)
    made, given = estimator()
    memory = made.init()
    for frame, left in enumerate(time[-1] - time):
        scene = together(box(0.7 + 0.25 * left, 0.0, 0.3), Scene(((-2.0, 0.5, 2.0, 0.5),)))
        readings = scan(given, scene, np.zeros((1, 3)), frame)
        known, memory = made.step_towards(readings, frame * PERIOD, memory, np.array([[3.0, 0.0]]))
    beside, ahead = known.G[0, :, 1] > 0.95, known.G[0, :, 0] > 0.6
    assert beside.any() and not known.closing_speeds[0, beside].any()
    assert known.closing_speeds[0, ahead].max() > 0.15


def test_a_face_whose_newest_place_is_left_out_may_be_a_line():
    """All others are older than the scans that are told apart: when the newest of them was seen counts."""
    made, _ = estimator()
    rng = np.random.default_rng(8)
    (window, count, path), normal = places(rng, 0.0, 0.005, 0.001)
    window.memory["scan"][0], window.memory["time"][0] = 60, 6.0
    window.x[0] += 0.3
    assert straight_face((window, count, path), (1.0, 0.0), made.parameters).found
    assert normal[0] == 1.0


def test_no_line_is_remembered_as_none():
    assert not line_at(no_lines(1), 0).found
