"""Line fits against planted lines, and their covariance against the scatter of seeded trials."""

import numpy as np
import pytest
from scipy.stats import chi2

from pbrg_mj.perception.frames import to_world
from pbrg_mj.perception.lines import Line, bend, deviations, fit_line, misfit
from pbrg_mj.perception.points import scan_points
from pbrg_mj.perception.setup import PoseNoise, beam_directions
from tests.raycast import Scene, cast

STD = 0.005
BEAMS = 72


def planted(angle: float, offset: float, left: float, right: float) -> Scene:
    """A wall with the given normal angle and offset from the origin, between two places along it."""
    n, t = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    return Scene(((*(offset * n + left * t), *(offset * n + right * t)),))


def fit(ranges: np.ndarray) -> Line:
    return fit_line(scan_points(ranges, beam_directions(BEAMS)), STD)


def wrapped(angle: np.ndarray | float) -> np.ndarray | float:
    return np.remainder(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi


@pytest.mark.parametrize("angle", np.linspace(-3.1, 3.1, 12))
@pytest.mark.parametrize("offset", [0.1, 0.8, 2.5])
def test_exact_ranges_give_the_exact_line(angle: float, offset: float) -> None:
    line = fit(cast(planted(angle, offset, -1.0, 1.7), np.zeros(3), BEAMS))
    assert wrapped(line.angle - angle) == pytest.approx(0, abs=1e-9)
    assert line.offset == pytest.approx(offset, abs=1e-9)
    assert line.normal == pytest.approx([np.cos(angle), np.sin(angle)], abs=1e-9)
    assert np.abs(line.residual).max() < 1e-9


@pytest.mark.parametrize(("offset", "left", "right"), [(0.5, -1, 1), (1.5, -1, 1), (1.0, 0.3, 1.6), (2.5, -2, 0.5)])
def test_the_covariance_is_that_of_the_errors(offset: float, left: float, right: float) -> None:
    trials, true = 600, 0.7
    random = np.random.default_rng(5)
    exact = cast(planted(true, offset, left, right), np.zeros(3), BEAMS)
    lines = [fit(exact + STD * random.standard_normal(BEAMS)) for _ in range(trials)]
    errors = np.array([[wrapped(line.angle - true), line.offset - offset] for line in lines])
    covariance = fit(exact).covariance
    square = [e @ np.linalg.solve(line.covariance, e) for e, line in zip(errors, lines, strict=True)]
    low, high = chi2.ppf([0.025, 0.975], 2 * trials) / trials
    assert low < np.mean(square) < high  # normalised error squared, mean 2
    std = np.sqrt(np.diag(covariance))
    assert np.all(np.abs(errors.mean(axis=0)) < 0.2 * std)  # the weights' bias and 3.5 / sqrt(600) of scatter
    assert np.sqrt((errors**2).mean(axis=0)) == pytest.approx(std, rel=3.5 / np.sqrt(2 * trials))
    assert np.corrcoef(errors.T)[0, 1] == pytest.approx(covariance[0, 1] / std.prod(), abs=0.1)


def test_the_straightness_tests_have_their_distributions() -> None:
    random = np.random.default_rng(6)
    exact = cast(planted(0.2, 1.0, -0.2, 3.0), np.zeros(3), BEAMS)
    exact[2:13:2] = np.nan  # points crowd at one end
    lines = [fit(exact + STD * random.standard_normal(BEAMS)) for _ in range(1000)]
    freedom = len(lines[0].residual) - 2
    sums = np.array([misfit(line, STD) for line in lines])
    assert sums.mean() == pytest.approx(freedom, rel=3.5 * np.sqrt(2 / freedom / 1000))
    assert np.mean(sums > chi2.ppf(0.99, freedom)) == pytest.approx(0.01, abs=0.01)
    bends = np.array([bend(line, STD) for line in lines])
    assert bends.std() == pytest.approx(1, rel=0.08) and abs(bends.mean()) < 0.11
    scores = np.array([deviations(line, STD) for line in lines])
    assert scores.std(axis=0) == pytest.approx(np.ones(freedom + 2), rel=0.1)


def test_a_circle_bends() -> None:
    ranges = np.full(BEAMS, np.nan)
    ranges[:9] = 0.5
    assert abs(bend(fit(ranges), STD)) > 4


def test_the_world_covariance_holds_with_a_noisy_pose() -> None:
    trials, pose, noise = 800, np.array([2.0, -1.0, 0.6]), PoseNoise(0.01, 0.01)
    random = np.random.default_rng(8)
    scene = planted(0.3, 3.0, -1, 1.5)
    exact = cast(scene, pose, BEAMS)
    square = []
    for _ in range(trials):
        guess = pose + np.array([noise.position, noise.position, noise.heading]) * random.standard_normal(3)
        line = to_world(fit(exact + STD * random.standard_normal(BEAMS)), guess, noise)
        error = np.array([wrapped(line.angle - 0.3), line.offset - 3.0])
        square.append(error @ np.linalg.solve(line.covariance, error))
    low, high = chi2.ppf([0.025, 0.975], 2 * trials) / trials
    assert low < np.mean(square) < high


def test_the_world_line_is_the_planted_one() -> None:
    pose = np.array([2.0, -1.0, 0.6])
    scene = planted(0.3, 3.0, -1, 1.5)
    line = to_world(fit(cast(scene, pose, BEAMS)), pose, PoseNoise(0, 0))
    assert line.angle == pytest.approx(0.3, abs=1e-9) and line.offset == pytest.approx(3.0, abs=1e-9)
    assert line.distance == pytest.approx(3.0 - 2 * np.cos(0.3) + np.sin(0.3), abs=1e-9)
    tangent = np.array([-np.sin(0.3), np.cos(0.3)])
    heading = pose[2] + 2 * np.pi * np.arange(BEAMS) / BEAMS
    hits = pose[:2] + cast(scene, pose, BEAMS)[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    low, high = np.nanmin(hits @ tangent), np.nanmax(hits @ tangent)
    assert line.middle == pytest.approx(3.0 * line.normal + 0.5 * (low + high) * tangent, abs=1e-9)
    assert line.length == pytest.approx(high - low, abs=1e-9)
