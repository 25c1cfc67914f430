"""The wheel-speed loop on board, and what the motor driver makes of commands."""

import numpy as np
import pytest

from pbrg_mj.world.actuation.motor_driver import quantise, saturate
from pbrg_mj.world.actuation.speed_loop import TIME_CONSTANT, speed_loop
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()


def looped(**sections) -> MujocoPlant:
    drive = {"kind": "speed_loop"} | sections.pop("drive", {})
    return MujocoPlant(scenario(drive=drive, **sections))


def speeds(world: MujocoPlant, command: tuple[float, float], seconds: float) -> np.ndarray:
    seen = []
    for _ in range(round(seconds / 0.01)):
        world.advance(np.array([command]))
        seen.append(world.truth().wheel_speed[0])
    return np.array(seen)


def test_poles_lie_where_the_derivation_puts_them():
    """J s^2 + k (K + kp) s + k ki = J (s + 1 / (2 tau))^2 with k = K / R."""
    loop, k = speed_loop(ROBOT, 0.002, 0), ROBOT.stall_torque / ROBOT.voltage
    polynomial = [ROBOT.driven_inertia, k * (loop.feed_forward + loop.proportional), k * loop.integral]
    np.testing.assert_allclose(np.roots(polynomial), -1 / (2 * TIME_CONSTANT), rtol=1e-6)


def test_one_step_by_hand_and_no_wind_up():
    loop = speed_loop(ROBOT, 0.002, 0)
    wanted, speed, integral_voltage = np.array([[1.0, 40.0]]), np.array([[0.5, 0.0]]), np.array([[0.2, 0.1]])
    voltage, after = loop.voltage(wanted, speed, integral_voltage)
    first = loop.feed_forward + 0.5 * loop.proportional + 0.2
    np.testing.assert_allclose(voltage, [[first, ROBOT.voltage]], rtol=1e-12)
    np.testing.assert_allclose(after, [[0.2 + 0.5 * loop.integral * 0.002, 0.1]], rtol=1e-12)
    _, unwound = loop.voltage(np.array([[0.0, 0.0]]), np.array([[1.0, 1.0]]), np.array([[90.0, 90.0]]))
    assert (unwound < 90).all()  # saturated, but the error takes it back


@pytest.mark.parametrize("physics_step", [0.0005, 0.001, 0.002])
@pytest.mark.parametrize("wanted", [0.05, 0.2, 1.0, 10.0, -10.0, 47.0])
def test_wheels_turn_as_fast_as_told_whatever_the_friction(physics_step, wanted):
    """Friction's breakaway would stop the open loop below 3 rad/s."""
    world = looped(timing={"physics_step": physics_step}, world={"rolling_resistance": 0.05 if wanted < 40 else 0.0})
    seen = speeds(world, (wanted, wanted), 5.0)[-200:]
    np.testing.assert_allclose(seen.mean(), wanted, rtol=1e-2)


def test_a_step_settles_within_a_tenth_of_a_second_and_a_fifth_over():
    seen = speeds(looped(drive={"friction": 0.0}), (10.0, 10.0), 1.0)[:, 0]
    assert seen.max() < 12.0
    assert np.abs(seen[15:] - 10).max() < 0.5


def test_a_held_robot_stays_put_at_zero_speed():
    world = looped()
    speeds(world, (10.0, 6.0), 1.0)
    speeds(world, (0.0, 0.0), 2.0)
    before = world.truth().body_pose
    speeds(world, (0.0, 0.0), 2.0)
    assert np.abs(world.truth().body_pose - before).max() < 2e-5


def test_a_robot_held_up_by_a_wall_pushes_with_no_more_than_its_supply_and_leaves_when_told():
    world = looped(walls=(wall((0.3, -1), (0.3, 1)),))
    speeds(world, (10.0, 10.0), 3.0)
    assert np.abs(world.data.ctrl).max() <= ROBOT.voltage
    seen = speeds(world, (-10.0, -10.0), 0.5)
    np.testing.assert_allclose(seen[-1], -10.0, rtol=0.02)


def test_a_wheel_in_the_air_is_stable_at_every_allowed_step():
    """The loaded gains on a fifth of the inertia: J dw = dt k (V - K w), stepped as the physics does, no friction."""
    for step in (0.0005, 0.001, 0.002):
        loop, k = speed_loop(ROBOT, step, 0), ROBOT.stall_torque / ROBOT.voltage
        w, integral_voltage = np.zeros((1, 1)), np.zeros((1, 1))
        for _ in range(2000):
            voltage, integral_voltage = loop.voltage(np.full((1, 1), 10.0), w, integral_voltage)
            w = w + step * k * (voltage - ROBOT.motor_constant * w) / ROBOT.wheel_inertia
        np.testing.assert_allclose(w, 10.0, rtol=1e-6)


def test_duty_cycles_are_rounded_to_the_nearest_both_ways_and_zero_levels_leave_voltages():
    voltage = np.array([[0.0, 6.0], [-6.0, 1.49], [1.51, -0.76], [0.74, -0.74]])
    np.testing.assert_allclose(quantise(voltage, 6.0, 4), [[0, 6], [-6, 1.5], [1.5, -1.5], [0, 0]], atol=1e-15)
    assert quantise(voltage, 6.0, 0) is voltage
    rng = np.random.default_rng(1)
    many = rng.uniform(-6, 6, (500, 2))
    assert np.abs(quantise(many, 6.0, 255) - many).max() <= 6 / 255 / 2 + 1e-12


def test_saturation_keeps_the_ratio():
    np.testing.assert_array_equal(saturate(np.array([[96.0, -24.0], [1.0, 2.0]]), 48.0), [[48.0, -12.0], [1.0, 2.0]])


def test_the_loop_drives_through_coarse_duty_cycles():
    world = looped(drive={"pwm_levels": 31})
    seen = speeds(world, (10.0, 10.0), 3.0)
    assert seen[-200:].mean() == pytest.approx(10.0, rel=0.02)
    levels = world.data.ctrl / ROBOT.voltage * 31
    np.testing.assert_allclose(levels, np.rint(levels), atol=1e-9)
