"""Points beside a corner are of the wall that their beams meet; what hides a wall is no corner of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.perception.scan.extract_lines import Lines, extract_lines
from pbrg_mj.perception.scan.joined_ends import _without_two
from pbrg_mj.perception.scan.line_fit import RESIDUAL, WEIGHT, S
from pbrg_mj.scenario.schema import Beams
from tests.raycast import Scene, cast
from tests.scans import sensor

ORIGIN = np.zeros(3)


def room(random: np.random.Generator) -> np.ndarray:
    """Corners (4, 2) of a rectangle around the robot, some turn."""
    (a, b), (c, d) = random.uniform(0.5, 2.0, 2), random.uniform(0.5, 2.0, 2)
    turn = random.uniform(0, 2 * np.pi)
    corners = np.array([[a, -d], [a, b], [-c, b], [-c, -d]])
    return corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])


def scene(corners: np.ndarray) -> Scene:
    pairs = zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True)
    return Scene(tuple((*a, *b) for a, b in pairs))


def errors(lines: Lines, corners: np.ndarray) -> np.ndarray:
    """Normalised errors squared of the lines, each against the wall most alike in angle."""
    along = np.roll(corners, -1, axis=0) - corners
    angle = np.arctan2(-along[:, 0], along[:, 1])
    offset = corners[:, 0] * np.cos(angle) + corners[:, 1] * np.sin(angle)
    found = []
    for k in range(len(lines)):
        turn = np.angle(np.exp(1j * (lines.angle[k] - angle)))
        of = int(np.argmin(np.abs(turn)))
        error = np.array([turn[of], lines.offset[k] - offset[of]])
        found.append(error @ np.linalg.solve(lines.covariance[k], error))
    return np.array(found)


def test_walls_of_rooms_are_as_right_as_their_covariance_says_in_heavy_noise() -> None:
    """3 % of the range and outliers: by the noise alone who owns a point beside a corner, the mean is near 3."""
    random, of = np.random.default_rng(8), sensor("robotarium")
    found = []
    for _ in range(250):
        corners = room(random)
        lines = extract_lines(of.look(scene(corners), ORIGIN, random), of.directions, of.params)
        found += errors(lines, corners).tolist()
    assert len(found) > 900
    assert 1.7 < np.mean(found) < 2.5


def test_a_corner_that_another_line_hides_is_counted() -> None:
    """One beam meets the wall beyond a corner, the next what hides it: were that point the wall's, the mean is 2.6."""
    random, of, found = np.random.default_rng(41), sensor("robotarium"), []
    for _ in range(1500):
        corner = 2.5 / np.tan(np.deg2rad(random.uniform(75, 80)))
        walls = Scene(((-1.5, 2.5, corner, 2.5), (corner, 2.5, corner, 0.9), (0.28, 0.85, 1.5, 0.85)))
        lines = extract_lines(of.look(walls, ORIGIN, random), of.directions, of.params)
        for k in np.flatnonzero((abs(lines.angle - 0.5 * np.pi) < 0.3) & (lines.offset > 2.0)):
            error = np.array([lines.angle[k] - 0.5 * np.pi, lines.offset[k] - 2.5])
            found.append(error @ np.linalg.solve(lines.covariance[k], error))
    assert len(found) > 1200
    assert 1.8 < np.mean(found) < 2.3


def with_pillars(corners: np.ndarray, side: float) -> np.ndarray:
    """Corners (12, 2) of a room with a square pillar in each corner, whose faces are too short to be lines."""
    after, before = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    first, last = (side * way / np.linalg.norm(way, axis=1)[:, None] for way in (before, after))
    return np.stack([corners + first, corners + first + last, corners + last], axis=1).reshape(-1, 2)


def test_a_wall_beside_what_gives_no_line_is_as_sure_as_its_last_points() -> None:
    """Nothing but their residuals tells whose the last points are: were they all the wall's, the mean would be 3.0."""
    random, of = np.random.default_rng(23), sensor("tof_ring")
    found = []
    for _ in range(300):
        walls, side = room(random), random.uniform(0.1, 0.24)
        lines = extract_lines(of.look(scene(with_pillars(walls, side)), ORIGIN, random), of.directions, of.params)
        found += errors(lines, walls).tolist()
    assert len(found) > 600
    assert 1.6 < np.mean(found) < 2.4


@pytest.mark.parametrize("preset", ["generic", "lidar"])
def test_a_wall_that_hides_another_has_no_corner_with_it(preset: str) -> None:
    """A board before a wall, its end free: the farther wall begins where the board ends, and they meet elsewhere."""
    random, of = np.random.default_rng(9), sensor(preset)
    for _ in range(60):
        near, tilt = random.uniform(0.8, 1.2), random.uniform(-0.4, 0.4)
        board = (near, -1.0, near + tilt, 0.3)
        lines = extract_lines(of.look(Scene((board, (1.6, -3.0, 1.6, 3.0))), ORIGIN, random), of.directions, of.params)
        walls = np.array([[1.6, -3.0], [1.6, 3.0]])
        of_board = np.array([board[:2], board[2:]])
        for k, square in enumerate(np.minimum(errors(lines, walls), errors(lines, of_board))):
            assert square < 25, (k, lines.angle, lines.offset)


def test_exact_ranges_give_the_corner_to_whom_its_beams_meet() -> None:
    random = np.random.default_rng(10)
    of = sensor("ideal")
    assert of.beams == Beams(preset="ideal")
    for _ in range(40):
        corners = room(random)
        lines = extract_lines(of.look(scene(corners), ORIGIN, random), of.directions, of.params)
        assert len(lines) == 4 and errors(lines, corners).max() < 1e-6


def obtuse_room(random: np.random.Generator) -> np.ndarray:
    """Corners (6, 2) of a hexagon on a circle, at random about the robot: each turns by 45 deg or more."""
    gaps = np.deg2rad(45) + random.dirichlet(np.full(6, 3.0)) * np.deg2rad(90)
    angle = random.uniform(0, 2 * np.pi) + np.cumsum(gaps)
    corners = random.uniform(1.2, 2.5) * np.column_stack([np.cos(angle), np.sin(angle)])
    return corners - random.uniform(0.0, 0.8) * corners[0]


def test_the_second_last_point_counts_in_the_covariance_of_the_errors() -> None:
    """In heavy noise two points of the next wall fit beside an obtuse corner; by the last alone the mean is 2.05."""
    random, of, found = np.random.default_rng(29), sensor("robotarium"), []
    for _ in range(1200):
        corners = obtuse_room(random)
        lines = extract_lines(of.look(scene(corners), ORIGIN, random), of.directions, of.params)
        by_errors = replace(lines, covariance=lines.error_covariance)
        found.append([errors(lines, corners).sum(), errors(by_errors, corners).sum(), len(lines)])
    by_last, by_both, count = np.sum(found, axis=0)
    assert count > 5000
    assert 1.9 < by_both / count < 2.0 < by_last / count


def points_of_line(random: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (count,) along a line, weights (count,) and residuals (count,) of the best line through them."""
    s, w = np.sort(random.uniform(-1.0, 1.0, count)), random.uniform(1e3, 1e4, count)
    X, y = np.column_stack([s, -np.ones(count)]), random.standard_normal(count) / np.sqrt(w)
    return s, w, y - X @ np.linalg.solve((X.T * w) @ X, (X.T * w) @ y)


def test_what_a_line_is_without_its_last_two_points_is_the_fit_to_the_others() -> None:
    """And their odds are those of their normal densities about a wall that leaves the line between two beams."""
    random = np.random.default_rng(12)
    for count in (5, 6, 12):
        s, w, residual = points_of_line(random, count)
        at = np.zeros((count, 4))
        at[:, S], at[:, WEIGHT], at[:, RESIDUAL] = s, w, residual
        mean = w @ s / w.sum()
        moments, offset = (w.sum(), mean, w @ (s - mean) ** 2, s[0], s[-1]), -0.11
        odds, moved, grows = _without_two(moments, at, (count - 1, count - 2), offset)
        X, left = np.column_stack([s, -np.ones(count)]), slice(0, count - 2)
        P, of_left = np.linalg.inv((X.T * w) @ X), np.linalg.inv((X[left].T * w[left]) @ X[left])
        line = of_left @ (X[left].T * w[left]) @ residual[left]  # de/dtheta = s, de/dc = -1
        np.testing.assert_allclose(moved, -line, rtol=1e-9)
        np.testing.assert_allclose(grows, (of_left - P)[[0, 0, 1], [0, 1, 1]], rtol=1e-7)
        two = X[-1:-3:-1]
        W = np.linalg.inv(np.diag(1 / w[-1:-3:-1]) + two @ of_left @ two.T)
        seen = residual[-1:-3:-1] - two @ line
        u = (np.arange(400) + 0.5) / 400
        means = offset * np.column_stack([(1 + u) / (2 + u), u / (2 + u)])
        density = np.exp(-0.5 * np.einsum("ui,ij,uj->u", seen - means, W, seen - means) + 0.5 * seen @ W @ seen)
        assert odds == pytest.approx(np.mean(density / (2 + u)) / np.log(2), rel=0.1)  # a sum of eight there


def test_exact_ranges_are_uncertain_by_a_tenth_of_a_millimetre_and_weighted_by_one() -> None:
    """A wall with free ends, no noise: the variance of the errors is a hundredth."""
    of = sensor("ideal")
    lines = extract_lines(of.look(Scene(((1.0, -0.8, 1.0, 0.9),)), ORIGIN, None), of.directions, of.params)
    assert len(lines) == 1
    np.testing.assert_allclose(lines.error_covariance[0], 0.01 * lines.covariance[0], rtol=1e-9)
    noisy = sensor("generic")
    lines = extract_lines(cast(Scene(((1.0, -0.8, 1.0, 0.9),)), ORIGIN, 72), noisy.directions, noisy.params)
    np.testing.assert_allclose(lines.error_covariance[0], lines.covariance[0], rtol=1e-9)
