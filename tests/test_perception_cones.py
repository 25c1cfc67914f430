"""Lines of cones: where in its view a cone meets a wall, the walls of rooms, ends in view, and rows of robots."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.scan.cone import chord_normal, ray
from pbrg_mj.perception.scan.extract_lines import extract_lines, line_workspace
from pbrg_mj.perception.scan.points import write_points
from tests.raycast import Scene
from tests.scans import planted, sensor

HALF = np.deg2rad(13.5)
CONES = sensor("tof_cones", noise_std=0.0, noise_ratio=0.0, quantum=0.0, dropout=0.0, outliers=0.0, cone_rays=31)


def wrapped(angle: float) -> float:
    return float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def nearest_of(axis: float, normal: float, offset: float) -> float:
    """What a cone reads of a wall without ends [m]: the least of many rays, inf if none meets it."""
    cosine = np.cos(axis + np.linspace(-HALF, HALF, 40001) - normal)
    return float(np.min(np.where(cosine > 0.0, offset / np.maximum(cosine, 1e-9), np.inf)))


def points_of(ranges: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Points (B, 6) of beams of exact ranges."""
    directions, work = np.column_stack([np.cos(axes), np.sin(axes)]), line_workspace(len(axes))
    write_points(ranges, directions, CONES.params, work.points, work.hits)
    return work.points


def test_a_cone_meets_a_wall_where_that_is_nearest_in_its_view() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        axis, normal, offset = random.uniform(-np.pi, np.pi), random.uniform(-np.pi, np.pi), random.uniform(0.2, 2.0)
        if np.cos(axis - normal) < 0.2:
            continue
        read, n = nearest_of(axis, normal, offset), (np.cos(normal), np.sin(normal))
        points = points_of(np.array([read]), np.array([axis]))
        found = ray(points, CONES.params.half_cone, 0, *n)
        assert np.dot(n, found[2:]) == pytest.approx(offset, abs=1e-7)
        assert np.linalg.norm(found[:2]) == pytest.approx(1.0)


def test_two_cones_tell_a_wall() -> None:
    """Exactly, unless both have its foot in view: then one of the walls that are so far away in both views."""
    random, exact = np.random.default_rng(2), 0
    for _ in range(500):
        axes = random.uniform(-np.pi, np.pi) + np.array([0.0, np.deg2rad(random.uniform(15, 120))])
        normal, offset = axes[0] + random.uniform(-1.0, 1.0) * np.pi / 2, random.uniform(0.2, 2.0)
        if np.any(np.cos(axes - normal) < 0.2):
            continue
        points = points_of(np.array([nearest_of(axis, normal, offset) for axis in axes]), axes)
        nx, ny, length = chord_normal(points, CONES.params.half_cone, 0, 1)
        if np.all(np.abs(axes - normal) < HALF):
            assert length == pytest.approx(0.0, abs=1e-3)  # a root of rounding
            assert np.all(np.cos(np.arctan2(ny, nx) - axes) > np.cos(HALF) - 1e-3)
            continue
        assert wrapped(np.arctan2(ny, nx) - normal) == pytest.approx(0.0, abs=2e-4)  # as well
        exact += 1
    assert exact > 200


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.7])
def test_walls_of_a_room_are_where_they_are(turn: float) -> None:
    """Rays 0.9 degrees apart stand for cones here: the nearest is within 0.1 mm of what a cone would read."""
    room = Scene(((-1.0, -0.9, 1.2, -0.9), (1.2, -0.9, 1.2, 1.1), (1.2, 1.1, -1.0, 1.1), (-1.0, 1.1, -1.0, -0.9)))
    params = CONES.params._replace(min_points=5)
    lines = extract_lines(CONES.look(room, np.array([0.0, 0.0, turn]), None), CONES.directions, params)
    assert len(lines) >= 3  # one may have beams too few
    for angle, offset in zip(lines.angle, lines.offset, strict=True):
        quarter = round((angle + turn) / (np.pi / 2))
        assert angle + turn == pytest.approx(quarter * np.pi / 2, abs=2e-3)
        assert offset == pytest.approx((1.2, 1.1, 1.0, 0.9)[quarter % 4], abs=1e-3)


def test_the_end_of_a_wall_does_not_turn_it() -> None:
    """Its foot is 13 degrees before its end: what the first cones see is the end, up to 2.6 % farther than the line."""
    random, of, errors = np.random.default_rng(4), sensor("tof_cones", dropout=0.0, outliers=0.0), []
    params = of.params._replace(min_points=5)
    for _ in range(400):
        normal = random.uniform(-np.pi, np.pi)
        wall = planted(normal, 0.5, 0.5 * np.tan(np.deg2rad(13.0)), 4.0)
        lines = extract_lines(of.look(wall, np.zeros(3), random), of.directions, params)
        for k in range(len(lines)):
            error = np.array([wrapped(lines.angle[k] - normal), lines.offset[k] - 0.5])
            errors.append((*error, error @ np.linalg.solve(lines.error_covariance[k], error)))
    found = np.array(errors)
    assert len(found) > 50
    assert np.all(np.abs(found[:, :2].mean(axis=0)) < 3.0 * found[:, :2].std(axis=0) / np.sqrt(len(found)))
    assert found[:, 2].mean() < 2.5


def test_any_scan_of_cones_is_allowed() -> None:
    random, seen = np.random.default_rng(5), 0
    for _ in range(60):
        of = sensor("tof_cones", count=int(random.integers(2, 40)), cone_deg=random.uniform(0.1, 60.0))
        for _ in range(20):
            ranges = random.choice([0.0, 1e-12, 1.0, 3.0], of.beams.count) * random.choice([1.0, 0.98], of.beams.count)
            ranges[random.uniform(size=len(ranges)) < 0.1] = np.nan
            lines = extract_lines(ranges, of.directions, of.params._replace(min_points=3))
            assert np.isfinite(lines.angle).all() and np.isfinite(lines.error_covariance).all()
            seen += len(lines)
    assert seen > 10
