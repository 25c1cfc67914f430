"""The speed up to which a robot's heading settles behind delays, against the delayed equation itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pbrg_mj.governor.certificate.steering import GAIN_MARGIN, mean_delay, steerable_speed
from pbrg_mj.governor.certified.advance_limits import speed_facets
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.world.scene.robot import load_robot_model

ROBOT = load_robot_model()


def growth_of_heading(speed: float, delay: float) -> float:
    """Return the growth of beta from the middle to the end: Euler steps of the loop with its delay and lag."""
    step = 2e-4
    late, beta, rate = [0.1] * round(delay / step), [0.1], 0.0
    for k in range(round(60 * delay / step) + 20_000):
        seen = late[k] if k < len(late) else beta[k - len(late)]
        rate += step / ROBOT.time_constant * (-speed / ROBOT.hand_offset * seen - rate)
        beta.append(beta[-1] + step * rate)
    size = np.abs(beta)
    half = len(size) // 2
    return float(size[half:].max() / size[:half].max())


@pytest.mark.parametrize("delay", [0.03, 0.1, 0.2])
def test_beyond_the_margin_the_heading_diverges_and_below_it_does_not(delay: float) -> None:
    limit = GAIN_MARGIN * steerable_speed(ROBOT, delay)
    assert growth_of_heading(0.97 * limit, delay) < 1.0
    assert growth_of_heading(1.03 * limit, delay) > 1.0


def test_without_lag_it_is_the_closed_form_of_a_pure_delay() -> None:
    slow = 1e3  # [s], far longer than the motors' lag
    assert steerable_speed(ROBOT, slow) == pytest.approx(
        ROBOT.hand_offset * math.pi / (2 * slow) / GAIN_MARGIN, rel=1e-3
    )


def test_only_known_delays_slow_robots_down() -> None:
    slow, plain = load_scenario("network/slow_radio").scenario, load_scenario("sensing/ideal_sensor").scenario
    assert mean_delay(slow) == pytest.approx(0.05 + 1 / 60 + 0.03)
    assert len(speed_facets(plain, wheels=True)) == 4
    slowest = 1 / np.linalg.norm(speed_facets(slow, wheels=True), axis=1).max()
    assert slowest <= steerable_speed(ROBOT, mean_delay(slow))
