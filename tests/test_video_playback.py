import numpy as np
import pytest

from pbrg_mj.video.playback import between, held, latest, motion_of, smoothed
from tests.runs import replaced as changed
from tests.runs import resting, scenario


def ticks(**changes):
    return changed(resting(scenario()), **changes)


def test_wheels_turn_by_the_integral_of_their_speed():
    """Speed 2 + 3 t is integrated exactly by trapezoids: 2 t + 1.5 t^2."""
    time = 0.5 * np.arange(21)
    speed = np.broadcast_to((2 + 3 * time)[:, None, None], (21, 2, 2)) * [1.0, -1.0]
    wheel = motion_of(ticks(wheel_speed=speed)).wheel
    expected = 2 * time + 1.5 * time**2
    np.testing.assert_allclose(wheel[:, 1], np.column_stack([expected, -expected]))


def test_headings_turn_the_short_way_through_pi():
    pose = resting(scenario()).body_pose_true.copy()
    pose[3:, 0, 2], pose[:3, 0, 2] = -3.1, 3.1
    turned, _ = motion_of(ticks(body_pose_true=pose)).at(1.25)
    assert np.cos(turned[0, 2]) == pytest.approx(-1.0)
    assert turned[0, 2] == pytest.approx(np.pi)


def test_positions_are_linear_between_ticks_and_exact_at_them():
    pose = resting(scenario()).body_pose_true.copy()
    pose[:, 1, 0] = np.arange(21.0) ** 2
    motion = motion_of(ticks(body_pose_true=pose))
    assert motion.at(2.0)[0][1, 0] == 16.0
    assert motion.at(2.25)[0][1, 0] == pytest.approx((16 + 25) / 2)
    assert motion.at(99.0)[0][1, 0] == 400.0
    assert motion.at(-1.0)[0][1, 0] == 0.0


def test_what_is_not_a_number_repeats_the_last_that_is():
    values = np.array([[np.nan, 1.0], [2.0, np.inf], [np.nan, np.nan], [3.0, 4.0]])
    np.testing.assert_array_equal(held(values), [[0, 1], [2, 1], [2, 1], [3, 4]])


def test_the_running_mean_keeps_lines_and_holds_the_ends():
    line = 3.0 * np.arange(50)[:, None] + [0.0, 7.0]
    np.testing.assert_allclose(smoothed(line, 11)[5:-5], line[5:-5])
    np.testing.assert_allclose(smoothed(np.full((9, 2), 4.0), 100), 4.0)
    step = np.repeat([0.0, 1.0], 10)
    np.testing.assert_allclose(smoothed(step, 5)[8:12], [0.2, 0.4, 0.6, 0.8])


def test_the_latest_is_not_after():
    time = np.array([0.0, 0.1, 0.2])
    assert [latest(time, at) for at in (-0.1, 0.0, 0.15, 0.2, 9.0)] == [-1, 0, 1, 2, 2]
    assert between(time, np.array([1.0, 3.0, 5.0]), 0.05) == pytest.approx(2.0)
