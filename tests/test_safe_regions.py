"""The pure parts behind the comparison of half-spaces from points with IRIS and safe flight corridors."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.scenario.schema import Column, Wall
from pbrg_mj.world.scene.footprints import Footprints, footprints_of

SCRIPTS = Path(__file__).parents[1] / "scripts"
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
CLEARANCE = 0.1


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)


def solids() -> Footprints:
    """A wall from x = 0.95 to 1.05 m, and a column of 0.2 m."""
    wall = Wall.model_validate({"from": (1.0, -1.0), "to": (1.0, 1.0), "thickness": 0.1})
    return footprints_of([wall], [Column(center=(-1.0, 0.0), radius=0.2)])


def test_half_spaces_cut_a_square() -> None:
    from regions.polygon import area, cut

    half = cut(SQUARE, np.array([[1.0, 0.0]]), np.array([0.5]))
    assert area(half) == pytest.approx(1.0)
    corner = cut(SQUARE, np.array([[1.0, 1.0]]) / np.sqrt(2.0), np.array([np.sqrt(0.5)]))
    assert area(corner) == pytest.approx(0.5)
    assert len(cut(SQUARE, np.array([[1.0, 0.0], [0.0, 1.0]]), np.array([-0.1, 5.0]))) == 0
    np.testing.assert_allclose(cut(SQUARE, np.zeros((0, 2)), np.zeros(0)), SQUARE)
    assert area(np.zeros((0, 2))) == 0.0


def test_distance_of_a_place_from_a_polygon() -> None:
    from regions.polygon import distance

    assert distance(np.array([1.0, 1.5]), SQUARE) == 0.0
    assert distance(np.array([3.0, 1.5]), SQUARE) == pytest.approx(1.0)
    assert distance(np.array([5.0, 6.0]), SQUARE) == pytest.approx(5.0)
    assert distance(np.array([5.0, 6.0]), np.zeros((0, 2))) == np.inf


def test_a_hull_around_discs_holds_them_and_is_hardly_wider() -> None:
    from regions.polygon import around_discs

    random = np.random.default_rng(4)
    centres, radii = random.uniform(-1.0, 1.0, (9, 2)), random.uniform(0.05, 0.2, 9)
    G, h = around_discs(centres, radii)
    np.testing.assert_allclose(np.linalg.norm(G, axis=1), 1.0)
    support = (centres @ G.T + radii[:, None]).max(axis=0)
    assert np.all(h >= support - 1e-12) and np.all(h <= support + 0.01 * 0.2)


def test_what_a_region_is_worth() -> None:
    from regions.measures import Region, worth

    hand, target = np.zeros(2), np.array([2.0, 0.0])
    region = Region(np.array([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]]), np.array([0.85, 0.7, 1.4]))
    found = worth(region, (hand, target, 4.0), solids(), CLEARANCE)
    assert (found.holds, found.faces) == (True, 2)
    assert found.ahead == pytest.approx(0.85) and found.left == pytest.approx(1.15)
    strip = sum(c * np.sqrt(16.0 - c**2) + 16.0 * np.arcsin(c / 4.0) for c in (0.85, 0.7))
    assert found.area == pytest.approx(strip, rel=5e-3)
    assert found.too_near == 0.0 and found.depth == 0.0


def test_a_region_that_lets_in_too_near_says_by_how_much() -> None:
    from regions.measures import Region, worth

    region = Region(np.array([[1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]), np.array([0.9, 0.5, 0.5]))
    found = worth(region, (np.zeros(2), np.array([2.0, 0.0]), 0.95), solids(), CLEARANCE)
    assert found.depth == pytest.approx(CLEARANCE + 0.15, abs=0.003)  # 5 cm from the middle of the column
    nearest = worth(Region(*(one[:1] for one in region)), (np.zeros(2), np.array([2.0, 0.0]), 4.0), solids(), CLEARANCE)
    assert nearest.depth == pytest.approx(CLEARANCE + 0.2, abs=0.02)  # the column's middle
    assert 0.0 < nearest.too_near < 0.02
    outside = worth(Region(np.array([[1.0, 0.0]]), np.array([-0.1])), (np.zeros(2), np.ones(2), 0.5), solids(), 0.1)
    assert not outside.holds and outside.ahead == 0.0


def test_a_corridor_keeps_every_place_off_and_its_segment_in() -> None:
    from regions.corridor import corridor

    random = np.random.default_rng(5)
    for _ in range(50):
        path = np.array([[0.0, 0.0], random.uniform(-1.5, 1.5, 2)])
        places = random.uniform(-2.5, 2.5, (60, 2))
        along = path[1] / (path[1] @ path[1])
        across = np.linalg.norm(places - np.clip(places @ along, 0.0, 1.0)[:, None] * path[1], axis=1)
        places, insets = places[across > 0.2], random.uniform(0.05, 0.2, int((across > 0.2).sum()))
        G, h = corridor(places, lambda normals, insets=insets: np.tile(insets[:, None], len(normals)), path)
        assert np.all(path @ G.T <= h + 1e-9)
        behind = np.max(places @ G.T - insets[:, None] - h, axis=1)
        assert behind.min() >= -1e-9


def test_a_corridor_is_as_wide_as_the_ellipse_that_touches() -> None:
    from regions.corridor import ellipse

    path = np.array([[-1.0, 0.0], [1.0, 0.0]])
    shape = ellipse(np.array([[0.5, 0.3], [0.0, 0.9], [1.4, 0.1]]), path)
    width = 0.3 / np.sqrt(1.0 - 0.25)
    np.testing.assert_allclose(shape @ [0.5, 0.3] @ (shape @ [0.5, 0.3]), 1.0)
    np.testing.assert_allclose(np.abs(np.linalg.det(shape)), 1.0 / width)
    np.testing.assert_allclose(ellipse(np.array([[5.0, 5.0]]), path), np.eye(2))


def test_a_view_gives_all_methods_the_same_echoes() -> None:
    """Every place is in one cluster; from inside a square of walls no method lets a hand point through."""
    from regions.methods import CORRIDOR, FINER, OURS, rows
    from regions.views import view

    corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
    walls = [
        Wall.model_validate({"from": a, "to": b, "thickness": 0.1})
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    one = view("square", footprints_of(walls), [3, 1], "generic")
    assert sorted(np.concatenate(one.clusters).tolist()) == list(range(len(one.places.at)))
    assert len(one.places.at) == 3 * 72
    found = rows(one)
    for name in (OURS, FINER, CORRIDOR):
        worth = found[name].worth
        assert worth is not None and worth.holds and worth.depth <= 0.01
        assert 4.0 < worth.area < 3.7**2


def test_without_drake_the_script_says_so_in_one_line() -> None:
    blocked = "import sys; sys.modules['pydrake'] = None; sys.argv = ['safe_regions.py', '1', '--places', '1', "
    code = f"{blocked}'--families', 'boxes']; import safe_regions; safe_regions.main()"
    done = subprocess.run([sys.executable, "-c", code], cwd=SCRIPTS, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[0] == "no rows of IRIS: Drake is missing (pip install drake)"
    assert "half-spaces from points" in done.stdout and "IRIS" not in done.stdout


def test_insets_are_those_that_half_spaces_from_points_keep() -> None:
    """Along any direction as the estimator has them, with all of the range's deviations."""
    from regions.views import active, estimator, hand_of, scan, scenario, scene_of, seen

    from pbrg_mj.perception.points.known_free import Edge
    from pbrg_mj.perception.points.obstacle_points import inset_along, obstacle_points

    given, pose = scenario("robotarium", 3), np.array([0.2, 0.3, 0.4])
    made, target = estimator(given, 8), np.array([0.5, 1.0])
    _, memory = made.step_towards(scan(given, scene_of(solids()), pose, 0), 0.0, made.init(), target[None])
    places, _, _ = seen(memory, hand_of(pose), target, made)
    found, count = obstacle_points(memory.points[0], Edge(*np.empty((3, 0))), made.parameters)
    angles = np.linspace(0.0, 2 * np.pi, 7)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    expected = np.zeros((count, len(normals)))
    for k, normal in enumerate(normals):
        for i in range(count):
            inset, std = inset_along(found, i, (float(normal[0]), float(normal[1])), made.parameters)
            expected[i, k] = inset + made.parameters.sigmas * std
    assert count > 5 and len(active(memory).h)
    np.testing.assert_allclose(places.insets(normals), expected, rtol=1e-12)
