"""Lines of scans against planted ones, their covariance against the scatter, and the kernels against plain numpy."""

import numpy as np
import pytest
from scipy.stats import chi2

from pbrg_mj.perception.scan.extract_lines import Lines, extract_lines
from pbrg_mj.perception.scan.line_fit import RESIDUAL, WEIGHT, S, chi_squared_limit, straightness
from pbrg_mj.perception.scan.parameters import agreeing_beams
from pbrg_mj.perception.scan.robust_fit import HIDES_KINK, KINK, MAX_BEND
from tests.perception_oracle import find_lines
from tests.raycast import Scene
from tests.scans import SENSORS, Sensor, four_robots, planted, sensor

DEFAULT = sensor()


def lines_of(
    scene: Scene, of: Sensor = DEFAULT, random: np.random.Generator | None = None, heading: float = 0
) -> Lines:
    return extract_lines(of.look(scene, np.array([0, 0, heading]), random), of.directions, of.params)


def wrapped(angle: np.ndarray | float) -> np.ndarray | float:
    return np.remainder(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi


def errors(of: Sensor, offset: float, left: float, right: float, trials: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors (trials, 2) of angle and offset of a wall at random angles, and normalised errors squared."""
    random = np.random.default_rng(trials + round(100 * (offset + left)))
    error, square = [], []
    while len(error) < trials:
        angle = random.uniform(-3.1, 3.1)
        lines = lines_of(planted(angle, offset, left, right), of, random)
        if len(lines) == 1:  # the tests of straightness lose a few
            e = np.array([wrapped(lines.angle[0] - angle), lines.offset[0] - offset])
            error.append(e)
            square.append(e @ np.linalg.solve(lines.covariance[0], e))
    return np.array(error), np.array(square)


@pytest.mark.parametrize("angle", np.linspace(-3.1, 3.1, 12))
@pytest.mark.parametrize("offset", [0.5, 0.8, 2.5])
def test_exact_ranges_give_the_exact_line(angle: float, offset: float) -> None:
    lines = lines_of(planted(angle, offset, -1.0, 1.7))
    assert len(lines) == 1
    assert wrapped(lines.angle[0] - angle) == pytest.approx(0, abs=1e-9)
    assert lines.offset[0] == pytest.approx(offset, abs=1e-9)
    beam = 2 * np.pi * np.arange(72) / 72
    seen = offset * np.tan(wrapped(beam - angle))[np.cos(beam - angle) > 0.05]
    seen = seen[(seen >= -1.0) & (seen <= 1.7) & (np.hypot(offset, seen) < 3.98)]
    assert lines.low[0] == pytest.approx(seen.min(), abs=1e-9)
    assert lines.high[0] == pytest.approx(seen.max(), abs=1e-9)


SENSOR_CASES = {
    "additive": {},
    "multiplicative": {"noise_std": 0.0, "noise_ratio": 0.03},
    "quantised": {"quantum": 0.01},
    "both": {"noise_std": 0.01, "noise_ratio": 0.01, "quantum": 0.01, "count": 180},
}


@pytest.mark.parametrize("keys", SENSOR_CASES.values(), ids=SENSOR_CASES.keys())
@pytest.mark.parametrize(("offset", "left", "right"), [(0.5, -1, 1), (1.5, -1, 1), (1.0, 0.0, 2.6)])
def test_the_covariance_is_that_of_the_errors(keys: dict, offset: float, left: float, right: float) -> None:
    trials = 1200
    error, square = errors(sensor(**keys), offset, left, right, trials)
    low, high = chi2.ppf([0.025, 0.975], 2 * trials) / trials
    assert low < square.mean() < high  # mean 2
    assert np.all(np.abs(error.mean(axis=0)) < 0.16 * error.std(axis=0))


@pytest.mark.parametrize("noise", [{"noise_std": 0.0, "noise_ratio": 0.03}, {"noise_std": 0.06}])
def test_a_line_seen_obliquely_is_not_turned_by_the_noise(noise: dict) -> None:
    error, _ = errors(sensor(count=360, **noise), 1.9, -2.5, 0.3, 1000)
    assert np.all(np.abs(error.mean(axis=0)) < 0.1 * error.std(axis=0))  # of total least squares: 0.17 to 0.24


def test_the_covariance_counts_strays_that_pass_for_points_of_the_wall() -> None:
    keys = {"noise_std": 0.0, "noise_ratio": 0.03, "outliers": 0.05}
    _, square = errors(sensor(**keys), 1.8, -0.9, 0.9, 3000)
    low, high = chi2.ppf([0.025, 0.975], 2 * len(square)) / len(square)
    assert low < square.mean() < high  # 2.15 if they do not count


@pytest.mark.parametrize(
    ("preset", "angle_deg", "offset"), [("generic", 0.25, 0.002), ("tof_ring", 1.0, 0.01), ("robotarium", 2.0, 0.02)]
)
def test_single_scans_are_this_exact_at_one_and_a_half_metres(preset: str, angle_deg: float, offset: float) -> None:
    error, _ = errors(sensor(preset), 1.5, -3.0, 3.0, 300)
    angle, place = np.sqrt((error**2).mean(axis=0))
    assert np.rad2deg(angle) < angle_deg and place < offset


@pytest.mark.parametrize("preset", [name for name in SENSORS if name != "tof_cones"])
def test_the_kernels_do_what_plain_numpy_does(preset: str) -> None:
    random, of, seen = np.random.default_rng(3), sensor(preset), 0
    for _ in range(80 if preset == "lidar" else 250):
        walls = [(*random.uniform(-2.5, 2.5, 2), *random.uniform(-2.5, 2.5, 2)) for _ in range(random.integers(0, 5))]
        ranges = of.look(Scene(tuple(walls), four_robots(random)), np.zeros(3), random)
        lines, oracle = extract_lines(ranges, of.directions, of.params), find_lines(ranges, of.directions, of.params)
        assert len(lines) == len(oracle)
        for i, line in enumerate(oracle):
            assert wrapped(lines.angle[i] - line["angle"]) == pytest.approx(0, abs=1e-9)
            assert lines.offset[i] == pytest.approx(line["offset"], abs=1e-9)
            assert lines.covariance[i] == pytest.approx(line["covariance"], rel=1e-6, abs=1e-15)
            assert (lines.low[i], lines.high[i]) == pytest.approx((line["low"], line["high"]), abs=1e-9)
            assert (lines.free_low[i], lines.free_high[i]) == (line["free_low"], line["free_high"])
            seen += 1
    assert seen > 100


def test_the_limit_of_chi_squared_is_near_the_exact_one() -> None:
    for freedom in (1, 3, 10, 70):
        assert chi_squared_limit(freedom, 3.09) == pytest.approx(chi2.isf(1e-3, freedom), rel=0.04)


def test_enough_beams_agree() -> None:
    assert [agreeing_beams(p) for p in (0.0, 0.001, 0.02, 0.049, 0.2, 1.0)] == [2, 2, 2, 3, 5, 10]


def test_how_much_a_kink_bends_a_line() -> None:
    """The closed form behind HIDES_KINK, for evenly spread points of equal weight."""
    count, length, std, kink = 2001, 1.5, 0.03, 0.1
    at = np.zeros((count, 4))
    at[:, S], at[:, WEIGHT] = np.linspace(-length / 2, length / 2, count), std**-2
    at[:, RESIDUAL] = 0.5 * kink * np.abs(at[:, S])
    total, spread = at[:, WEIGHT].sum(), (at[:, WEIGHT] * at[:, S] ** 2).sum()
    _, bend = straightness(at, count, (total, 0.0, spread, -length / 2, length / 2))
    assert bend == pytest.approx(np.sqrt(15) / 16 * kink * np.sqrt(spread), rel=2e-3)
    assert pytest.approx(np.sqrt(15) / 16 * KINK / (MAX_BEND + 3.0)) == HIDES_KINK


def test_two_walls_that_noise_makes_one_are_rarely_taken_for_one() -> None:
    """Two walls of 1.5 m that meet at 25 degrees, 2.5 m away, with noise of 3 %."""
    random, of, ones = np.random.default_rng(8), sensor("robotarium"), 0
    turn = np.deg2rad(12.5)
    one = (2.5, 0.0, 2.5 - 1.5 * np.sin(turn), 1.5 * np.cos(turn))
    other = (2.5, 0.0, 2.5 - 1.5 * np.sin(turn), -1.5 * np.cos(turn))
    for _ in range(400):
        lines = extract_lines(of.look(Scene((one, other)), np.zeros(3), random), of.directions, of.params)
        ones += bool(np.any((lines.low < -0.5) & (lines.high > 0.5)))
    assert ones < 100  # a quarter; a third by the limit of other lines
