"""Which half-space an obstacle gives: planted boxes, corners and doorways."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from pbrg_mj.perception.obstacle.polygons import compiled_hull, gap, hull
from tests.perceiving import HAND, PENTAGON, box, rows, scenario, walk
from tests.raycast import Scene

EXACT = {"sensors": {"beams": {"noise_std": 0.0}, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}}}
OWN = {"scope": "own"}
CORNER = Scene(((1.0, -3.0, 1.0, 1.2), (1.0, 1.2, -3.0, 1.2)))
POSTS = ((-0.4, 1, -0.4, 1.1), (0.4, 1, 0.4, 1.1))
DOOR = Scene(((-2, 1, -0.4, 1), (0.4, 1, 2, 1), (-2, 1.1, -0.4, 1.1), (0.4, 1.1, 2, 1.1), *POSTS))


def known_after(given, scene, poses, scans=30):
    *_, (_, true, known, memory) = walk(given, lambda t: scene, lambda t: poses, scans)
    hand = true[:, :2] + HAND * np.column_stack([np.cos(true[:, 2]), np.sin(true[:, 2])])
    return known, hand, memory


def in_formation(x: float, y: float) -> list[tuple[float, float, float]]:
    return [(x + a, y + b, 0.0) for a, b in PENTAGON]


def test_a_wall_before_the_team_gives_exactly_the_papers_half_space() -> None:
    given = scenario(PENTAGON, estimator={"sigmas": 0.0}, **EXACT)
    known, _, _ = known_after(given, Scene(((1.5, -30, 1.5, 30),)), in_formation(0, 0), 1)
    assert known.active.sum(axis=1).tolist() == [1] * 5 and known.binds[:, 0].all()
    assert known.G[:, 0] == pytest.approx(np.tile([1.0, 0.0], (5, 1)), abs=1e-9)
    assert known.h[:, 0] == pytest.approx(1.4, abs=1e-9)


def test_a_box_with_two_faces_in_view_gives_one_half_space_that_all_can_satisfy() -> None:
    scene = box(1.25, 0.0, 0.9, angle=np.pi / 4)
    solid = np.array(scene.segments)[:, :2]
    small = tuple((a / 2, b / 2) for a, b in PENTAGON)
    known, hand, memory = known_after(scenario(small), scene, [(a, b, 0.0) for a, b in small], 40)
    assert memory.tracks[4]["confirmed"][memory.tracks[4]["live"] == 1].sum() == 2
    for robot in range(5):
        G, h = rows(known, robot)
        if len(G) == 0:
            continue  # too far from the box to make out a face
        assert len(G) == 1 and np.all(hand @ G[0] < h[0])
        assert np.all(solid @ G[0] > h[0] + 0.09)  # and the box is beyond, clearance and all
    assert len(rows(known, 4)[0]) == 1


def test_a_concave_corner_gives_both_half_spaces() -> None:
    known, _, _ = known_after(scenario(PENTAGON, estimator={"sigmas": 0.0}, **EXACT), CORNER, in_formation(0, 0), 2)
    for robot in range(5):
        G, h = rows(known, robot)
        order = np.argsort(h)
        assert G[order] == pytest.approx(np.eye(2), abs=1e-2) and h[order] == pytest.approx([0.9, 1.1], abs=1e-2)


@pytest.mark.parametrize("y", [0.3, 0.7, 0.95, 1.05, 1.15, 1.4])
def test_a_robot_in_a_doorway_is_free_to_go_on_under_its_own_scope(y: float) -> None:
    def through(time: float) -> list[tuple[float, float, float]]:
        return [(0.05, min(-0.5 + 0.3 * time, y), np.pi / 2)]

    *_, (_, true, known, _) = walk(scenario(estimator=OWN), lambda t: DOOR, through, 70)
    hand = true[0, :2] + [0, HAND]
    G, h = rows(known)
    assert len(G) >= 2 and np.all(h - G @ hand > 0.0)
    assert known.binds[0].sum() == known.active[0].sum()
    if 0.9 < y < 1.1:  # between the posts only the way across is barred
        assert np.abs(G[:, 0]).min() > 0.8


def test_a_team_that_straddles_a_doorway_is_told_so() -> None:
    given = scenario(PENTAGON, estimator={"scope": "team"})
    away = [(-9.0, -9.0 - 2 * k, 0.0) for k in range(5)]
    known, hand, memory = known_after(given, DOOR, [away[0], (0.0, 0.5, 1.57), *away[2:]])
    b = np.array(PENTAGON)
    team = hand[1] + b - b[1]
    G, h = rows(known, 1)
    assert memory.tracks[1]["own_only"].any()  # no half-space parts them all from the wall
    assert np.all(h - G @ hand[1] > 0) and np.any(h - team @ G.T < 0)
    assert known.binds[1][known.active[1]].all()


def test_scopes_bind_whom_they_say() -> None:
    for scope, mask in (("team", np.ones((5, 5))), ("own", np.eye(5))):
        given = scenario(PENTAGON, estimator={"scope": scope})
        known, _, _ = known_after(given, Scene(((1.5, -9, 1.5, 9),)), in_formation(0, 0), 1)
        assert np.array_equal(known.binds[:, 0], mask.astype(bool)) and not known.binds[:, 1:].any()


def test_a_half_space_moves_steadily_as_a_robot_rounds_a_box() -> None:
    def orbit(time: float) -> list[tuple[float, float, float]]:
        return [(1.0 * np.cos(0.15 * time), 1.0 * np.sin(0.15 * time), 0.15 * time + np.pi / 2)]

    last, turns, slots = None, [], set()
    for time, poses, known, _ in walk(scenario(estimator=OWN), lambda t: box(0, 0, 0.7), orbit, 420):
        if time < 4:
            continue
        assert known.active.any()
        k = int(np.argmin(np.where(known.active[0], known.h[0] - known.G[0] @ poses[0, :2], np.inf)))
        slots.add(k)
        g = known.G[0, k]
        if last is not None:
            turns.append(np.arccos(np.clip(g @ last, -1, 1)))
        last = g
    assert len(slots) == 1
    assert np.mean(np.array(turns) > np.deg2rad(15)) < 0.02


ROUNDING_A_BOX = """
from tests.perceiving import box, scenario, walk
def orbit(time):
    return [(1.0 - 0.1 * time, 0.6 - 0.2 * time, 1.5)]
for _, _, known, _ in walk(scenario(estimator={"scope": "own"}), lambda t: box(0, 0, 0.7), orbit, 60):
    print([x.hex() for x in (*known.h.ravel(), *known.G.ravel())], known.active.sum())
"""


def test_half_spaces_do_not_depend_on_how_freed_memory_is_filled() -> None:
    """Python's debug allocator overwrites what is freed: kernels that still read it give another answer, or crash."""
    printed = [
        subprocess.run(
            [sys.executable, "-c", ROUNDING_A_BOX],
            env=os.environ | {"PYTHONMALLOC": allocator},
            cwd=Path(__file__).parents[1],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for allocator in ("malloc", "debug")
    ]
    assert printed[0] == printed[1] and printed[0].count(" 1\n") > 10


def random_polygon(random: np.random.Generator, corners: int) -> np.ndarray:
    points = random.normal(size=(corners, 2))
    corners = hull(points)
    assert corners.tolist() == compiled_hull(points).tolist()
    return points[corners]


def test_the_gap_between_polygons_is_the_least_distance() -> None:
    random = np.random.default_rng(1)
    for _ in range(60):
        a, b = random_polygon(random, 7), random_polygon(random, 5) + random.uniform(3, 8, 2)
        gx, gy, width, i, j = gap(a, b)

        def distance(weights: np.ndarray, a: np.ndarray = a, b: np.ndarray = b) -> float:
            return float(np.sum((weights[: len(a)] @ a - weights[len(a) :] @ b) ** 2))

        ones = [slice(0, len(a)), slice(len(a), None)]
        sums = [{"type": "eq", "fun": lambda w, s=s: w[s].sum() - 1} for s in ones]
        start = np.concatenate([np.full(len(p), 1 / len(p)) for p in (a, b)])
        best = minimize(distance, start, bounds=[(0, 1)] * len(start), constraints=sums, tol=1e-12)
        assert width == pytest.approx(np.sqrt(best.fun), abs=1e-4)
        assert np.min(b @ [gx, gy]) - np.max(a @ [gx, gy]) == pytest.approx(width, abs=1e-12)
        assert b[i] @ [gx, gy] == pytest.approx(np.min(b @ [gx, gy])) == b[j] @ [gx, gy]
        assert gap(a, a + 0.01)[2] < 0 and gap(a, a * 0.5)[2] < 0


def test_hulls_of_few_points() -> None:
    assert hull(np.zeros((1, 2))).tolist() == [0]
    assert len(hull(np.zeros((5, 2)))) == 1
    assert sorted(hull(np.array([[0.0, 0], [1, 1], [2, 2], [0.5, 0.5]])).tolist()) == [0, 2]
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0.0]])
    assert hull(square).tolist() == [0, 1, 2, 3]
