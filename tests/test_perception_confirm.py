"""Which points confirm a lone echo: looked for quickly, and the same as by the definition of one place."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points import parameters
from pbrg_mj.perception.points.confirm import confirm_echo, earlier_echoes
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.parameters import confirmation_range
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.schema import Beams
from tests.seeing_points import estimator

POSE = ScanPose(0.4, -0.7, 0.3, 1e-6, 1e-5, 0.0, 0.0, 1.0, 0.1)
SCAN, RECENT, CONFIRMING = 20, 4, 6
NEAR = 1.2  # [m]


def test_points_at_one_place_are_found_and_no_others():
    made, draws, told = estimator()[0].parameters._replace(confirmation_range=NEAR), np.random.default_rng(3), []
    for _ in range(1000):
        echo = (*draws.uniform(-1.5, 1.5, 2), draws.uniform(0.0, 0.02), draws.uniform(0.0, 0.02))
        points = _points(draws, echo)
        told_before = points["confirmed_within"].copy()
        expected = [_at_one_place(point, echo, made) for point in points]
        needed = int(draws.integers(1, sum(expected) + 2))
        earlier = earlier_echoes(points, SCAN, RECENT, CONFIRMING)
        recent = sum(at for at, point in zip(expected, points, strict=True) if point["scan"] >= SCAN - RECENT)
        near = np.hypot(echo[0] - POSE.x, echo[1] - POSE.y) < NEAR
        enough = recent >= needed or sum(expected) > needed or (near and sum(expected) == needed)
        away = np.hypot(points["x"] - echo[0], points["y"] - echo[1])
        matches = np.array(expected) & enough
        nearest = confirm_echo(points, earlier, (echo, needed), POSE, made)
        np.testing.assert_allclose(nearest, away[matches].min() if enough else np.inf, rtol=1e-12)
        assert points["binds"].tolist() == matches.tolist()
        np.testing.assert_allclose(
            points["confirmed_within"], np.where(matches, np.minimum(away, told_before), told_before), rtol=1e-6
        )
        told.append((recent >= needed, int(np.sign(sum(expected) - needed)), bool(near)))
    cases = [(False, more, near) for more in (-1, 0, 1) for near in (False, True)]
    assert min(told.count(one) for one in [*cases, (True, 1, False)]) > 5


def test_outliers_that_are_near_confirm_each_other_as_seldom(monkeypatch: pytest.MonkeyPatch):
    """Twice in a thousand scans here, of outliers drawn anywhere along their beams."""
    monkeypatch.setattr(parameters, "FALSE_ECHOES", 2e-3)
    beams = Beams(preset="tof_ring", outliers=0.02)
    near = confirmation_range(beams, 2, 54)
    assert beams.range_min < near < 0.5 * beams.range_max
    draws, scans, found = np.random.default_rng(4), 200_000, 0
    std = np.hypot(beams.noise_std, beams.noise_ratio * beams.range_max / 2)
    for outliers in draws.binomial(beams.count, beams.outliers, scans):
        for range_m in draws.uniform(beams.range_min, beams.range_max, outliers):
            if range_m < near:
                earlier = draws.binomial(54 * 3, beams.outliers)  # on its own beam and the two beside it
                others = draws.uniform(beams.range_min, beams.range_max, earlier)
                found += np.count_nonzero(np.abs(others - range_m) <= 3.0 * np.sqrt(2.0) * std + 0.02) >= 2
    assert 1e-3 < found / scans < 2.5e-3


def test_where_outliers_are_seldom_all_echoes_are_near():
    assert confirmation_range(Beams(outliers=0.0), 1, 100) == Beams().range_max


def _points(draws: np.random.Generator, echo) -> np.ndarray:
    """Points about the place of an echo, along and across its beam, some dead, some of other scans."""
    points = no_points(1, 150)[0]
    beam = np.array([echo[0] - POSE.x, echo[1] - POSE.y])
    beam /= np.linalg.norm(beam)
    along, across = draws.normal(0.0, 0.1, 150), draws.normal(0.0, 0.2, 150)
    points["x"] = echo[0] + along * beam[0] - across * beam[1]
    points["y"] = echo[1] + along * beam[1] + across * beam[0]
    points["std"], points["pose_std"] = draws.uniform(0.0, 0.02, (2, 150))
    points["scan"], points["live"] = draws.integers(SCAN - 8, SCAN + 1, 150), draws.uniform(size=150) < 0.8
    points["confirmed_within"] = np.where(draws.uniform(size=150) < 0.5, np.inf, draws.uniform(0.0, 0.05, 150))
    return points


def _at_one_place(point, echo, made) -> bool:
    """Three standard deviations along the beam of ranges and across it of poses, and a gap to either side."""
    away = np.array([echo[0] - POSE.x, echo[1] - POSE.y])
    distance = np.linalg.norm(away)
    ux, uy = away / distance
    dx, dy = point["x"] - echo[0], point["y"] - echo[1]
    poses = 3.0 * np.hypot(echo[3], point["pose_std"]) + 0.02
    along = 3.0 * np.hypot(echo[2], point["std"]) + poses
    near = abs(dx * ux + dy * uy) <= along and abs(dx * uy - dy * ux) <= made.gap * distance + poses
    return bool(point["live"] and SCAN - CONFIRMING <= point["scan"] < SCAN and near)
