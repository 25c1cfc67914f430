"""Half-spaces from points: seen things of any shape against the ray-caster's truth, and what must not bind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from pbrg_mj.errors import InputError
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.hull import distance_to_hull
from pbrg_mj.perception.points.parameters import range_sigmas
from pbrg_mj.scenario.load import load_text
from tests.perceiving import box, rows
from tests.raycast import Scene, cast
from tests.seeing_points import PERIOD, ROBOT, estimator, scan, sensor

WALL = Scene(((2.0, -3.0, 2.0, 3.0),))
L_SHAPE = Scene(
    (
        (2.0, -1.0, 2.0, 1.0),
        (2.0, 1.0, 3.0, 1.0),
        (3.0, 1.0, 3.0, 0.0),
        (3.0, 0.0, 4.0, 0.0),
        (4.0, 0.0, 4.0, -1.0),
        (4.0, -1.0, 2.0, -1.0),
    )
)


def drive(given, made: PointEstimator, scene: Scene, start: float, end: float, target: float, y: float = 0.0):
    """Drive along x at 0.2 m/s, a scan each `PERIOD`; yield the hand point's x [m] and the half-spaces."""
    memory, goal = made.init(), np.array([[target, y]])
    for frame, x in enumerate(np.arange(start, end, 0.2 * PERIOD)):
        pose = np.array([[x, y, 0.0]])
        known, memory = made.step_towards(scan(given, scene, pose, frame), frame * PERIOD, memory, goal)
        yield x + ROBOT.hand_offset, known


def warning(given, made: PointEstimator, scene: Scene, contact: float) -> float:
    """Return how far before the hand point's x of contact a half-space forbids it for good [m]; negative: never."""
    first = np.inf
    for hand, known in drive(given, made, scene, contact - 1.5, contact - ROBOT.hand_offset, contact + 2.0):
        G, h = rows(known)
        forbidden = np.any(G @ [contact, 0.0] > h)
        first = min(first, hand) if forbidden else np.inf
    return contact - first


@pytest.mark.parametrize(("preset", "least"), [("default", 12), ("lidar", 12), ("tof_ring", 11)])
@pytest.mark.parametrize("shape", ["box", "pillar"])
def test_a_small_thing_ahead_is_known_before_contact(preset: str, least: int, shape: str):
    """Boxes of 12 to 60 cm at any angle and pillars of 5 cm to 3 m: known 0.2 m before contact, head-on at 0.2 m/s."""
    found = 0
    for seed in range(12):
        rng = np.random.default_rng([seed, 7])
        made, given = estimator(sensor(preset))
        given = given.model_copy(update={"seed": seed})
        if shape == "box":
            width, angle = rng.uniform(0.12, 0.6), rng.uniform(0.0, np.pi)
            scene = box(0.0, 0.0, width, angle=angle)
            ahead = -float(np.nanmin(cast(scene, np.array([-2.0, 0.0, 0.0]), 72)) - 2.0)
        else:
            radius = float(np.exp(rng.uniform(np.log(0.05), np.log(3.0))))
            scene = Scene((), ((0.0, 0.0, radius),))
            ahead = radius
        contact = -ahead - ROBOT.body_radius + ROBOT.hand_offset
        found += warning(given, made, scene, contact) >= 0.2
    assert found >= least


@pytest.mark.parametrize("scene", [WALL, L_SHAPE, box(2.3, 0.2, 1.0, 0.3, 0.7)], ids=["wall", "L", "box"])
def test_no_admitted_point_is_near_what_was_seen(scene: Scene):
    """Faces seen from where the robot is, exactly: admitted hand points keep the clearance, up to the beams' gaps."""
    made, given = estimator()
    allowed = 0.01
    faces = np.concatenate([np.linspace(s[:2], s[2:], 200) for s in np.array(scene.segments)])
    crossed, checked = 0, 0
    for seed in range(6):
        given = given.model_copy(update={"seed": seed})
        y = 0.3 * seed - 0.7
        *_, (hand, known) = drive(given, made, scene, 0.0, 1.0, 1.6, y)
        G, h = rows(known)
        corner = np.array([hand, y])
        grid = corner + np.random.default_rng(seed).uniform(-1.5, 1.5, (2000, 2))
        admitted = grid[np.all(grid @ G.T <= h, axis=1)]
        near = faces[np.linalg.norm(faces - corner, axis=1) < 1.2]
        visible = near[[_sees(scene, corner, face) for face in near]]
        if len(visible) and len(admitted):
            gaps = np.linalg.norm(admitted[:, None] - visible[None], axis=2)
            crossed += int(np.any(gaps < ROBOT.clearance - allowed))
            checked += 1
    assert checked >= 3 and crossed == 0


def _sees(scene: Scene, origin: np.ndarray, face: np.ndarray) -> bool:
    way = face - origin
    pose = np.array([*origin, np.arctan2(way[1], way[0])])
    return bool(cast(scene, pose, 4)[0] > np.linalg.norm(way) - 1e-6)


def test_a_wall_gives_one_half_space_where_a_line_would_be():
    """Within the noise: no farther off than the clearance, three standard deviations and 1 cm."""
    made, given = estimator()
    *_, (_, known) = drive(given, made, WALL, 0.0, 1.2, 3.0)
    G, h = rows(known)
    ahead = int(np.argmax(G[:, 0]))
    assert np.hypot(*(G[ahead] - [1.0, 0.0])) < np.deg2rad(1.5)
    reach = (h[ahead] - G[ahead, 1] * 0.0) / G[ahead, 0]
    assert 2.0 - ROBOT.clearance - 3.0 * 0.005 - 0.015 < reach < 2.0 - ROBOT.clearance + 0.003


@pytest.mark.parametrize("preset", ["default", "robotarium", "tof_ring", "lidar"])
@pytest.mark.parametrize("speed", [0.0, 0.01, 0.2], ids=["rest", "creep", "drive"])
def test_rows_of_team_mates_bind_nobody(preset: str, speed: float):
    """Four robots abreast, 0.14 to 0.5 m apart, to and fro in an empty world: outliers, too, give no half-space."""
    rng = np.random.default_rng([7, int(100 * speed)])
    row = [[0.0, 0.0, 0.0]] + [[rng.uniform(0.5, 1.5), (k - 1.5) * rng.uniform(0.14, 0.5), 1.0] for k in range(4)]
    made, given = estimator(sensor(preset), formation=tuple((x, y) for x, y, _ in row))
    memory, heard = made.init(), 0
    for frame in range(100):
        poses = np.array(row)
        poses[1:, 0] += speed * PERIOD * abs((frame + 20) % 40 - 20)
        bodies = Scene((), tuple((x, y, ROBOT.body_radius) for x, y, _ in poses[1:]))
        one = scan(given, [bodies, *[Scene()] * 4], poses, frame)
        heard += int(np.isfinite(one.ranges[0]).sum())
        known, memory = made.step_towards(one, frame * PERIOD, memory, np.zeros((5, 2)))
        assert not known.active[0].any()
    assert heard > 100


@pytest.mark.parametrize("preset", ["ideal", "default", "tof_ring"])
def test_team_mates_near_by_bind_nobody_however_wrong_places_are(preset: str):
    """With exact ranges all echoes of a team-mate are off its disc by the error of both robots' places, at once."""
    row = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.22, 0.0], [-0.18, 0.0, 0.0], [0.0, -0.25, 0.0]])
    made, given = estimator(sensor(preset), formation=tuple((x, y) for x, y, _ in row))
    memory, bodies = made.init(), Scene((), tuple((x, y, ROBOT.body_radius) for x, y, _ in row[1:]))
    for frame in range(600):
        one = scan(given, [bodies, *[Scene()] * 4], row, frame)
        known, memory = made.step_towards(one, frame * PERIOD, memory, np.zeros((5, 2)))
        assert not known.active[0].any()


@pytest.mark.parametrize(("beams", "bind"), [((43, 45, 47), False), ((43, 44, 45), False), ((42, 43, 45, 47), True)])
def test_outliers_in_a_row_bind_no_sooner_than_a_lone_one_is_confirmed(beams: tuple[int, ...], bind: bool):
    """With `robotarium` a lone echo needs three others: three outliers near each other come once in 10^4 scans."""
    made, given = estimator(sensor("robotarium"))
    assert made.parameters.confirmations == 3
    one = scan(given, Scene(), np.zeros((1, 3)), 0)
    one.ranges[0] = np.nan
    one.ranges[0, list(beams)] = 2.5
    known, _ = made.step_towards(one, 0.0, made.init(), np.array([[0.0, -3.0]]))
    assert known.active.any() == bind


def test_a_lone_echo_binds_when_a_second_confirms_it():
    made, given = estimator()
    post = Scene((), ((1.0, 0.0, 0.01),))
    first, memory = made.step_towards(scan(given, post, np.zeros((1, 3)), 0), 0.0, made.init(), np.array([[3.0, 0.0]]))
    assert not first.active.any()
    second, _ = made.step_towards(scan(given, post, np.zeros((1, 3)), 1), 0.1, memory, np.array([[3.0, 0.0]]))
    assert second.active.sum() == 1


@pytest.mark.parametrize("outlier", [0.3, 0.6, 0.9])
def test_an_outlier_beside_a_wall_is_not_of_the_wall(outlier: float):
    """Before it and behind a silent beam: a robot that took both for one thing would stop before nothing."""
    made, given = estimator(sensor("tof_ring"))
    one = scan(given, Scene(((1.5, -6.0, 1.5, 6.0),)), np.zeros((1, 3)), 0)
    beams = given.sensors.beams.count
    last = int(np.nanargmax(np.where(np.arange(beams) < beams // 2, one.ranges[0], np.nan)))
    one.ranges[0, last + 1], one.ranges[0, last + 2] = np.nan, outlier
    known, memory = made.step_towards(one, 0.0, made.init(), np.array([[0.0, 0.0]]))
    points = memory.points[0]
    near = np.hypot(points["x"], points["y"]) < 1.2
    assert (points["live"] & near).sum() == 1 and not (points["live"] & near & points["binds"]).any()
    assert known.h[known.active].min() > 1.0


def test_an_outlier_before_a_near_wall_waits_for_its_confirmation():
    """It lies within 0.2 m of the wall's echoes beside it: joined to them, it flung a team back from its wall."""
    made, given = estimator(sensor("robotarium"))
    memory, wall = made.init(), Scene(((0.25, -6.0, 0.25, 6.0),))
    for frame in range(12):
        one = scan(given, wall, np.zeros((1, 3)), frame)
        one.ranges[0, :3] = one.ranges[0, -2:] = 0.25
        if frame >= 6:  # from now on something stands there
            one.ranges[0, 0] = 0.1
        _, memory = made.step_towards(one, frame * PERIOD, memory, None)
        points = memory.points[0]
        near = points["live"] & points["binds"] & (np.abs(points["y"]) < 0.01)
        near &= (points["x"] > 0.0) & (points["x"] < 0.15)
        assert near.any() == (frame >= 6 + made.parameters.confirmations)


def test_what_beams_pass_is_gone_and_what_is_silent_stays():
    made, given = estimator()
    thing, behind = box(1.0, 0.0, 0.3), Scene(((3.0, -4.0, 3.0, 4.0),))
    goal = np.array([[1.5, 0.0]])
    for gone, active in ((behind, False), (Scene(), True)):
        memory, known = made.init(), HalfSpaces.empty(1, 6)
        for frame in range(33):  # a robot that stands takes some scans to tell that no edge was passed
            seen = thing if frame < 3 else gone
            one = scan(given, seen, np.zeros((1, 3)), frame)
            known, memory = made.step_towards(one, frame * PERIOD, memory, goal)
        G, h = rows(known)
        assert bool(np.any(h < G @ [1.0, 0.0])) == active


def test_nothing_is_kept_beyond_the_memory():
    made, given = estimator()
    memory = made.init()
    _, memory = made.step_towards(scan(given, WALL, np.zeros((1, 3)), 0), 0.0, memory, None)
    known, _ = made.step_towards(scan(given, Scene(), np.zeros((1, 3)), 200), 20.0, memory, None)
    assert not known.active.any()


def test_what_is_too_near_to_be_seen_is_kept_beyond_the_memory():
    """A robot rests where the face is nearer than the shortest range that beams tell, and then drives away."""
    made, given = estimator(sensor("lidar"))
    near, memory = made.parameters.range_min - 0.02, made.init()
    place = np.array([[0.5 - near, 0.0, 0.0]])
    _, memory = made.step_towards(
        scan(given, Scene(((0.5, -0.05, 0.5, 0.05),)), np.zeros((1, 3)), 0), 0.0, memory, None
    )
    for frame in range(1, 400):
        known, memory = made.step_towards(scan(given, Scene(), place, frame), frame * PERIOD, memory, None)
        assert known.active.any()
    for frame in range(400, 403):
        known, memory = made.step_towards(scan(given, Scene(), np.zeros((1, 3)), frame), frame * PERIOD, memory, None)
    assert not known.active.any()


def test_the_gap_to_a_hull_is_that_of_an_optimizer():
    rng = np.random.default_rng(5)
    for _ in range(40):
        count = int(rng.integers(1, 9))
        P = rng.normal(size=(count, 2))
        P[:, 0] += rng.uniform(0.0, 3.0)
        way = rng.normal(size=4)
        gap, x, y = distance_to_hull(P[:, 0].copy(), P[:, 1].copy(), count, tuple(way))

        def squared(w, P=P, way=way):
            t = w[-1]
            return float(np.sum((w[:-1] @ P - (1 - t) * way[:2] - t * way[2:]) ** 2))

        begin = np.append(np.full(count, 1.0 / count), 0.5)
        sums = {"type": "eq", "fun": lambda w: np.sum(w[:-1]) - 1.0}
        best = minimize(squared, begin, bounds=[(0, 1)] * (count + 1), constraints=sums, tol=1e-12)
        assert gap == pytest.approx(np.sqrt(max(best.fun, 0.0)), abs=2e-4)
        assert np.hypot(x, y) == pytest.approx(gap, abs=1e-12)


def test_the_nearest_of_many_echoes_is_behind_as_seldom_as_one():
    rng, sigmas = np.random.default_rng(6), 2.0
    left = range_sigmas(sigmas)
    for count in (1, 2, 5, 9):
        nearest = rng.normal(size=(200_000, count)).min(axis=1)
        share = np.mean(nearest > left[count - 1])
        assert share == pytest.approx(norm.sf(sigmas), rel=0.06) or left[count - 1] == 0.0


def test_points_need_the_scope_own():
    text = "team: {start: [[0, 0]], formation: [[0, 0]], leaders: [1]}\noperator: {reference: [0, 0]}\n"
    with pytest.raises(InputError, match=r"estimator\.scope.*own"):
        load_text(text, "a", ["estimator.source=points", "estimator.scope=team"], file="a.yaml")


def test_memories_are_never_written_to():
    made, given = estimator()
    _, memory = made.step_towards(scan(given, WALL, np.zeros((1, 3)), 0), 0.0, made.init(), None)
    held = (memory.points, memory.anchors, memory.past, memory.past_poses, memory.tracks, memory.half_spaces.h)
    before = [array.tobytes() for array in held]
    made.step_towards(scan(given, WALL, np.full((1, 3), 0.1), 1), 0.1, memory, np.zeros((1, 2)))
    for old, now in zip(before, held, strict=True):
        assert old == now.tobytes()


def test_how_much_room_a_memory_has_changes_nothing():
    made, given = estimator()
    narrow = wide = made.init()
    most = 8 * given.sensors.beams.count
    for frame in range(12):
        pose = np.array([[0.05 * frame, 0.0, 0.1 * frame]])
        seen = scan(given, L_SHAPE, pose, frame)
        room = np.zeros((1, most - narrow.used), narrow.points.dtype)
        wide = wide._replace(points=np.concatenate([wide.points[:, : wide.used], room], axis=1), used=most)
        found, narrow = made.step_towards(seen, 0.1 * frame, narrow, np.array([[1.0, 0.0]]))
        same, wide = made.step_towards(seen, 0.1 * frame, wide, np.array([[1.0, 0.0]]))
        np.testing.assert_array_equal(found.h, same.h)
        np.testing.assert_array_equal(found.G, same.G)
        assert narrow.points.shape[1] < most
    assert found.active.any()


def test_a_post_whose_edge_beams_pass_again_and_again_stays():
    """One of 24 beams meets it; then the robot turns by two degrees, and that beam goes past its edge."""
    made, given = estimator(sensor("tof_ring"))
    post, wall, goal = ((0.24, 0.014, 0.02),), (1.0, -2.0, 1.0, 2.0), np.array([[1.5, 0.0]])
    memory = made.init()
    for frame in range(20):
        pose = np.array([[0.0, 0.0, 0.0 if frame < 5 else np.deg2rad(-2.0)]])
        one = scan(given, Scene((wall,), post), pose, frame)
        known, memory = made.step_towards(one, frame * PERIOD, memory, goal)
    assert one.ranges[0, 0] > 0.9  # at the wall: past the post
    G, h = rows(known)
    assert np.any(h < G @ [0.5, 0.0])
