"""The beam model term by term, where beams point, and the presets."""

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import PRESETS, Beams, beam_angles
from pbrg_mj.sensing.beam_model import noisy_scan, quantised
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.worlds import scenario, wall

EXACT = SensorNoise(3, (0,), 0.0, 0.0, range_min=0.1, range_max=4.0, range_std=0.0, dropout=0.0)
COUNT = 40000


def scan(raw: float | np.ndarray, frame: int = 0, **changes: float) -> np.ndarray:
    ranges = np.broadcast_to(raw, COUNT).astype(float)
    return noisy_scan(ranges, replace(EXACT, **changes), stream(3, Source.BEAMS, 0, frame))


def test_without_noise_the_scan_is_the_truth_within_the_limits():
    raw = np.linspace(-1.0, 5.0, COUNT)
    within = (raw >= 0.1) & (raw < 4.0)
    np.testing.assert_array_equal(scan(raw), np.where(within, raw, np.nan))


@pytest.mark.parametrize("distance", [0.5, 1.0, 3.0])
def test_additive_and_multiplicative_noise_add_in_squares(distance):
    error = scan(distance, range_std=0.004, range_ratio=0.01) - distance
    std = np.hypot(0.004, 0.01 * distance)
    assert abs(error.mean()) < 3.5 * std / np.sqrt(COUNT)
    assert error.std() == pytest.approx(std, rel=3.5 / np.sqrt(2 * COUNT))
    z = (error / std) ** 4
    assert z.mean() == pytest.approx(3.0, abs=3.5 * np.sqrt(96 / COUNT))  # as Gaussian as its tails


def test_ranges_are_the_nearest_whole_steps():
    error = scan(1.0, range_std=0.01)
    stepped = scan(1.0, range_std=0.01, quantum=0.003)
    np.testing.assert_allclose(stepped / 0.003, np.round(stepped / 0.003), atol=1e-9)
    assert np.abs(stepped - error).max() <= 0.0015 + 1e-12
    assert (stepped - error).std() == pytest.approx(0.003 / np.sqrt(12), rel=0.02)
    np.testing.assert_array_equal(quantised(np.array([0.1234, -1.0]), 0.0), [0.1234, -1.0])


def test_quantisation_comes_before_the_limits():
    assert np.isnan(scan(3.996, quantum=0.01)).all()  # is 4.0 after rounding
    np.testing.assert_allclose(scan(0.104, quantum=0.01), 0.1)


@pytest.mark.parametrize("raw", [1.0, -1.0])
def test_outliers_take_their_share_anywhere_between_the_limits_whatever_was_hit(raw):
    ranges = scan(raw, outliers=0.2)
    outliers = ranges[(ranges != raw) & ~np.isnan(ranges)]
    assert len(outliers) / COUNT == pytest.approx(0.2, abs=3.5 * np.sqrt(0.16 / COUNT))
    assert np.sum(ranges == raw) + np.sum(np.isnan(ranges)) == COUNT - len(outliers)
    counts, _ = np.histogram(outliers, bins=20, range=(0.1, 4.0))
    assert counts.sum() == len(outliers)
    expected = len(outliers) / 20
    assert ((counts - expected) ** 2 / expected).sum() < 43.8  # chi-square of 19 degrees of freedom, 0.1 %


def test_outliers_come_in_the_sensors_steps():
    outliers = scan(-1.0, outliers=1.0, quantum=0.05)
    outliers = outliers[~np.isnan(outliers)]
    np.testing.assert_allclose(outliers / 0.05, np.round(outliers / 0.05), atol=1e-9)
    assert (outliers.min(), outliers.max()) == pytest.approx((0.1, 3.95))


def test_dropout_comes_last_and_spares_no_outlier():
    assert np.isnan(scan(1.0, outliers=0.5, dropout=1.0)).all()
    kept = ~np.isnan(scan(1.0, outliers=0.5, dropout=0.3))
    assert kept.mean() == pytest.approx(0.7, abs=3.5 * np.sqrt(0.21 / COUNT))


def test_each_parameter_changes_what_it_says_and_no_other_draw():
    plain = scan(1.0, range_std=0.005, dropout=0.1)
    with_strays = scan(1.0, range_std=0.005, dropout=0.1, outliers=0.1)
    np.testing.assert_array_equal(np.isnan(plain), np.isnan(with_strays))
    assert np.mean((plain == with_strays) | np.isnan(plain)) == pytest.approx(0.9 + 0.1 * 0.1, abs=0.01)
    scaled = scan(1.0, range_std=0.005, dropout=0.1, range_ratio=0.02)
    ratio = (scaled - plain)[~np.isnan(plain)] / 0.02  # the multiplicative draws by themselves
    assert ratio.std() == pytest.approx(1.0, rel=3.5 / np.sqrt(2 * 0.9 * COUNT))
    assert abs(np.corrcoef(ratio, plain[~np.isnan(plain)])[0, 1]) < 3.5 / np.sqrt(0.9 * COUNT)


@pytest.mark.parametrize(
    ("keys", "degrees"),
    [
        ({"count": 4}, [0, 90, 180, 270]),
        ({"count": 4, "start_deg": -45}, [-45, 45, 135, 225]),
        ({"count": 3, "start_deg": -90, "sweep_deg": 180}, [-90, 0, 90]),
        ({"count": 2, "start_deg": 10, "sweep_deg": 0.5}, [10, 10.5]),
        ({"count": 1, "start_deg": 30, "sweep_deg": 90}, [30]),
        ({"count": 1}, [0]),
    ],
)
def test_where_beams_point(keys, degrees):
    np.testing.assert_allclose(np.rad2deg(beam_angles(Beams(**keys))), degrees, atol=1e-12)


def test_perception_reads_beams_where_they_were_sent():
    """The points of a raw scan, in the body frame, lie on the wall: x = 1.5 + hand offset."""
    plan = scenario(walls=(wall((1.55, -3), (1.55, 3)),), beams={"count": 9, "start_deg": -40, "sweep_deg": 80})
    ranges = MujocoPlant(plan).observe().ranges[0]
    points = ranges[:, None] * perception_setup(plan, 0.1, 0.04).directions
    np.testing.assert_allclose(points[:, 0], 1.54, atol=1e-9)
    np.testing.assert_allclose(points[:, 1], 1.54 * np.tan(np.deg2rad(np.linspace(-40, 40, 9))), atol=1e-9)


def test_a_preset_fills_in_and_keys_beside_it_win():
    bare, some = Beams(preset="tof_ring"), Beams.model_validate({"preset": "tof_ring", "count": 8, "dropout": 0})
    assert (bare.count, bare.range_max, bare.noise_std, bare.quantum) == (24, 3.0, 0.008, 0.001)
    assert (some.count, some.dropout, some.noise_std) == (8, 0.0, 0.008)
    assert Beams.model_validate({"preset": "none"}) == Beams(preset="generic") == Beams()
    for name in PRESETS:
        chosen = Beams.model_validate({"preset": name})
        assert chosen.range_min < chosen.range_max
        assert Beams.model_validate(chosen.model_dump()) == chosen


def test_the_scenario_sets_every_term():
    beams = {"preset": "robotarium", "quantum": 0.002}
    noise = sensor_noise(scenario(beams=beams, seed=4))
    assert (noise.range_std, noise.range_ratio, noise.dropout, noise.outliers) == (0.0, 0.03, 0.035, 0.014)
    assert (noise.quantum, noise.seed) == (0.002, 4)
    exact = sensor_noise(scenario(beams=beams, plant="ideal"))
    assert (exact.range_ratio, exact.dropout, exact.outliers, exact.quantum) == (0.0, 0.0, 0.0, 0.0)


def test_streams_differ_by_source_robot_frame_and_seed():
    firsts = {
        stream(seed, source, robot, frame).random()
        for seed in (1, 2)
        for source in Source
        for robot in (0, 1)
        for frame in (0, 1)
    }
    assert len(firsts) == 8 * len(Source)
    assert [int(source) for source in Source] == [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]
