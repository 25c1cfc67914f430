"""Which beam looks in a direction: quickly, and the same as by the exact angle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pbrg_mj.perception.points.beams import beams_beside, layout, nearest_beam, roughly_ahead
from pbrg_mj.perception.points.parameters import PointParameters
from tests.seeing_points import estimator

SENSORS = {
    "72 all round": {"count": 72},
    "360 all round": {"count": 360},
    "24 in front": {"count": 24, "sweep_deg": 180},
    "a gap of 1.3 beams behind": {"count": 40, "sweep_deg": 360 * 39 / 40.3},
    "a gap of less than a beam behind": {"count": 40, "sweep_deg": 360 * 39 / 39.7},
}


@pytest.mark.parametrize("beams", SENSORS.values(), ids=SENSORS)
def test_the_nearest_beam_is_that_of_the_exact_angle(beams: dict[str, float]):
    made = estimator({"beams": beams})[0].parameters
    for angle in _angles(made):
        x, y = 2.0 * math.cos(angle), 2.0 * math.sin(angle)
        rough = roughly_ahead(x, y, made.first, made.gap)
        assert nearest_beam(x, y, rough, layout(made)) == _nearest(math.atan2(y, x), made), angle


@pytest.mark.parametrize("beams", SENSORS.values(), ids=SENSORS)
def test_the_beams_on_either_side_are_those_of_the_exact_angle(beams: dict[str, float]):
    made = estimator({"beams": beams})[0].parameters
    for heading in (0.0, 2.5, -40.0):
        for angle in _angles(made):
            x, y = 2.0 * math.cos(angle + heading), 2.0 * math.sin(angle + heading)
            turns = (math.atan2(y, x) - heading - made.first) / (2.0 * math.pi)
            before = math.floor((turns - math.floor(turns)) * 2.0 * math.pi / made.gap)
            expected = before, before + 1
            if made.closed:
                expected = before % len(made.directions), (before + 1) % len(made.directions)
            elif before + 1 >= len(made.directions):
                expected = -1, -1
            assert beams_beside(x, y, heading, made.directions, made) == expected, (heading, angle)


def test_a_rough_angle_is_as_good_as_it_says():
    angles = np.linspace(-math.pi, math.pi, 20_001)[1:-1]
    rough = [roughly_ahead(3.0 * math.cos(angle), 3.0 * math.sin(angle), -math.pi, 1.0) for angle in angles]
    assert np.abs(np.array(rough) - math.pi - angles).max() < 1.2e-5


def _angles(made: PointParameters) -> np.ndarray:
    """Directions everywhere, and at and beside those where the answer steps."""
    steps = made.first + made.gap * np.arange(0.0, 2.0 * math.pi / made.gap, 0.5)
    steps = np.concatenate([steps, made.first - made.gap * np.array([0.5, 1.0])])
    near = [0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-5, -1e-5]
    drawn = np.random.default_rng(7).uniform(-math.pi, math.pi, 300)
    return np.concatenate([drawn, (steps[:, None] + near).ravel()])


def _nearest(angle: float, made: PointParameters) -> int:
    turns, beams = (angle - made.first) / (2.0 * math.pi), len(made.directions)
    ahead = (turns - math.floor(turns)) * 2.0 * math.pi / made.gap
    beam = math.floor(ahead + 0.5)
    if made.closed:
        return beam % beams
    if beam < beams:
        return beam
    return 0 if 2.0 * math.pi / made.gap - ahead < 0.5 else -1
