"""Points beside a corner are of the wall that their beams meet; what hides a wall is no corner of it."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.scan.extract_lines import Lines, extract_lines
from pbrg_mj.scenario.schema import Beams
from tests.raycast import Scene
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
