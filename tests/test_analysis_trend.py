"""Trends of synthetic trajectories with known answers; noise from many seeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.trend import Trend, trend

SPEED, TOLERANCE = 0.0005, 0.05  # the defaults [m/s], [m]
WINDOW, TICK = 20.0, 0.05
TIME = 40.0 + np.arange(0.0, WINDOW + TICK / 2, TICK)
AGO = TIME[-1] - TIME  # [s]
SEEDS = range(20)


def of(x: np.ndarray, y: np.ndarray | float = 0.0, target: tuple[float, float] = (0.0, 0.0)) -> Trend:
    """The trend of one robot at (x, y)."""
    place = np.stack(np.broadcast_arrays(x, y), axis=-1)
    return trend(TIME, place[:, None], np.linalg.norm(place - target, axis=1), SPEED, TOLERANCE)


def noise(seed: int, size: float = 0.002) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=size, size=len(TIME))


@pytest.mark.parametrize("tau", [4.0, 8.0, 15.0])
@pytest.mark.parametrize("limit", [0.0, 0.03, 0.2])
def test_an_exponential_approach_ends_where_and_when_its_formula_says(tau, limit):
    found = of(limit + 0.1 * np.exp(AGO / tau))
    assert found.direction == "closing in"
    # Sampled means are an exponential too, but for the one tick by which the thirds may differ.
    assert found.limit == pytest.approx(limit, abs=2e-3)
    if limit >= TOLERANCE:
        assert found.arrival == math.inf
    else:
        exact = TIME[-1] + tau * math.log(0.1 / (TOLERANCE - limit))
        assert found.arrival == pytest.approx(exact, abs=0.03 * (exact - TIME[-1]) + 0.2)


@pytest.mark.parametrize("tau", [21.0, 60.0, 400.0])
def test_an_approach_slower_than_the_window_arrives_no_sooner_than_told(tau):
    found = of(0.5 * np.exp(AGO / tau))
    assert found.direction == "closing in"
    assert math.isnan(found.limit)
    assert TIME[-1] < found.arrival < TIME[-1] + tau * math.log(0.5 / TOLERANCE)


@pytest.mark.parametrize("speed", [0.002, 0.03, 0.5])
def test_constant_speed_lasts(speed):
    found = of(1.0 + speed * AGO)
    assert (found.direction, found.rate) == ("closing in", pytest.approx(speed))
    assert found.arrival == pytest.approx(TIME[-1] + (1.0 - TOLERANCE) / speed)
    assert math.isnan(found.limit)
    assert of(-1.0 - speed * AGO[::-1]).direction == "receding"


def test_who_has_arrived_arrives_now():
    assert of(0.04 + 0.01 * AGO).arrival == TIME[-1]


@pytest.mark.parametrize("seed", SEEDS)
def test_noise_makes_no_trend_and_hides_none(seed):
    x, y = noise(seed), noise(seed + 100)
    assert of(0.4 + x, y).direction == "standing"
    assert of(0.4 + x + 0.003 * AGO, y).direction == "closing in"
    assert of(0.4 + x + 0.003 * AGO[::-1], y).direction == "receding"
    approach = of(0.2 + 0.1 * np.exp(AGO / 8.0) + x, y)
    assert approach.direction == "closing in"
    assert approach.limit == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("period", [3.0, 7.3, 19.0])
@pytest.mark.parametrize("target", [(0.0, 0.0), (0.4, 0.0), (0.0, 2.0)])
def test_a_circle_is_a_circle_wherever_the_target_is(seed, period, target):
    rng = np.random.default_rng(seed)
    phase, radius = rng.uniform(0, 2 * np.pi), rng.uniform(0.06, 0.3)
    angle = 2 * np.pi * TIME / period + phase
    found = of(radius * np.cos(angle) + noise(seed), radius * np.sin(angle) + noise(seed + 100), target)
    assert found.direction == "circling"
    assert found.extent >= 0.9 * radius


@pytest.mark.parametrize("seed", SEEDS)
def test_oscillation_is_circling_or_if_small_standing(seed):
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi)
    oscillation = np.sin(2 * np.pi * TIME / 5.0 + phase)
    assert of(1.0 + 0.2 * oscillation + noise(seed)).direction == "circling"
    assert of(1.0 + 0.02 * oscillation + noise(seed)).direction == "standing"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_drift_past_the_target_at_constant_distance_wanders(seed):
    angle = 0.6 + 0.02 * TIME + np.random.default_rng(seed).uniform(0, 2 * np.pi)
    assert of(np.cos(angle) + noise(seed), np.sin(angle) + noise(seed + 100)).direction == "wandering"


def test_a_spiral_into_the_target_closes_in():
    radius, angle = 0.1 * np.exp(AGO / 10.0), 2 * np.pi * TIME / 4.0
    assert of(radius * np.cos(angle), radius * np.sin(angle)).direction == "closing in"


def test_an_approach_that_has_stopped_is_none():
    x = np.where(AGO > 12.0, 0.3 + 0.1 * (AGO - 12.0), 0.3)
    assert of(x).direction in ("standing", "wandering")


def test_slower_than_the_speed_of_rest_is_no_trend():
    assert of(0.4 + 0.0004 * AGO).direction == "standing"
    assert of(0.4 + 0.0011 * AGO).direction == "closing in"  # the ends of thirds are a third of the window apart
