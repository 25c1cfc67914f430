import numpy as np
import pytest

from pbrg_mj.vehicle.drive import DifferentialDrive, Integrator, SpeedDrive, drive_of
from pbrg_mj.vehicle.hand_point import hand_point, wheel_speeds
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario

ROBOT = load_robot_model()


def random_motion(seed: int, n: int = 50) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, 2)), rng.uniform(-9, 9, n)


def hand_velocity(wheel_speed, heading):
    """The velocities (n, 2) of hand points whose wheels (n, 2) left, right [rad/s] roll without slip."""
    rim = ROBOT.wheel_radius * wheel_speed
    v, omega = rim.mean(axis=1), (rim[:, 1] - rim[:, 0]) / ROBOT.track
    ahead = np.column_stack([np.cos(heading), np.sin(heading)])
    across = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    return v[:, None] * ahead + ROBOT.hand_offset * omega[:, None] * across


def test_hand_point_is_ahead_of_the_axle():
    pose = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, np.pi / 2]])
    np.testing.assert_allclose(hand_point(pose, 0.04), [[1.04, 2.0], [1.0, 2.04]], atol=1e-15)


def test_wheel_speeds_are_inverted_exactly():
    velocity, heading = random_motion(1)
    back = hand_velocity(wheel_speeds(velocity, heading, ROBOT), heading)
    np.testing.assert_allclose(back, velocity, rtol=0, atol=1e-13)


def test_ahead_turns_both_wheels_alike_and_left_turns_the_right_wheel_forward():
    speeds = wheel_speeds(np.array([[0.1, 0.0], [0.0, 0.1]]), np.zeros(2), ROBOT)
    turn = 0.1 / ROBOT.hand_offset * ROBOT.track / 2 / ROBOT.wheel_radius
    np.testing.assert_allclose(speeds, [[0.1 / ROBOT.wheel_radius] * 2, [-turn, turn]], rtol=1e-14)


def test_wheel_speeds_move_the_hand_point_as_wanted():
    """Roll the unicycle for a short while and difference its hand point."""
    velocity, heading = random_motion(2)
    rim = ROBOT.wheel_radius * wheel_speeds(velocity, heading, ROBOT)
    v, omega, dt = rim.mean(axis=1), (rim[:, 1] - rim[:, 0]) / ROBOT.track, 1e-7
    poses = [
        np.column_stack([v * s * np.cos(heading), v * s * np.sin(heading), heading + omega * s]) for s in (-dt, dt)
    ]
    moved = (hand_point(poses[1], ROBOT.hand_offset) - hand_point(poses[0], ROBOT.hand_offset)) / (2 * dt)
    np.testing.assert_allclose(moved, velocity, atol=1e-6)


def test_drive_gives_the_back_emf_of_the_wanted_speed():
    command = DifferentialDrive(ROBOT).command(np.array([[0.2, 0.0]]), np.zeros((1, 3)))
    np.testing.assert_allclose(command, [[0.2 / ROBOT.top_speed * ROBOT.voltage] * 2], rtol=1e-13)


def test_duty_cycles_quantise_the_voltages_after_saturation():
    velocity, pose = np.array([[0.33, 0.0], [9.0, 0.0]]), np.zeros((2, 3))
    command = DifferentialDrive(ROBOT, pwm_levels=10).command(velocity, pose)
    np.testing.assert_allclose(command, [[1.8, 1.8], [6.0, 6.0]], rtol=1e-12)


COULOMB = ROBOT.coulomb_torque / ROBOT.stall_torque * ROBOT.voltage  # [V]


def test_friction_compensation_adds_the_voltage_of_coulomb_friction_in_the_wanted_direction():
    plan, velocity = scenario(drive={"friction_compensation": True}), np.array([[0.2, 0.0], [-0.2, 0.0], [0.0, 0.0]])
    command, plain = (
        drive.command(velocity, np.zeros((3, 3))) for drive in (drive_of(plan, ROBOT), DifferentialDrive(ROBOT))
    )
    np.testing.assert_allclose(command - plain, COULOMB * np.array([[1, 1], [-1, -1], [0, 0]]), rtol=1e-12)


def test_friction_compensation_leaves_the_direction_to_a_drive_told_too_much():
    velocity, heading = random_motion(6)
    pose = np.column_stack([np.zeros((50, 2)), heading])
    voltage = DifferentialDrive(ROBOT, friction=COULOMB).command(100 * velocity, pose)
    assert np.abs(voltage).max(axis=1) == pytest.approx(np.full(50, ROBOT.voltage))
    speeds = wheel_speeds(velocity, heading, ROBOT)
    turning = (voltage - COULOMB * np.sign(speeds)) / ROBOT.motor_constant
    np.testing.assert_allclose(turning[:, 0] * speeds[:, 1], turning[:, 1] * speeds[:, 0], rtol=1e-12)
    assert np.abs(turning).max(axis=1) == pytest.approx(np.full(50, ROBOT.loaded_speed))


@pytest.mark.parametrize("friction", [0.0, 100.0])
def test_friction_that_is_not_there_or_beyond_the_motor_is_not_compensated(friction):
    plan = scenario(drive={"friction_compensation": True, "friction": friction})
    assert drive_of(plan, ROBOT) == DifferentialDrive(ROBOT)


def test_an_omnidirectional_base_compensates_friction_likewise():
    robot, ahead = load_robot_model("omni"), np.array([[0.2, 0.0]])
    drive = drive_of(scenario(robot="omni", drive={"friction_compensation": True}), robot)
    (voltage,) = drive.command(ahead, np.zeros((1, 3)))
    speed = voltage[0] / robot.motor_constant - robot.coulomb_torque / robot.stall_torque * robot.no_load_speed
    assert (speed * robot.wheel_radius, voltage[1]) == (pytest.approx(0.2), 0.0)


def test_the_speed_drive_asks_for_the_wheel_speeds_themselves_up_to_what_a_motor_does():
    velocity, heading = random_motion(5)
    pose = np.column_stack([np.zeros((50, 2)), heading])
    slow = SpeedDrive(ROBOT).command(1e-2 * velocity, pose)
    np.testing.assert_array_equal(slow, wheel_speeds(1e-2 * velocity, heading, ROBOT))
    fast = SpeedDrive(ROBOT).command(100 * velocity, pose)
    np.testing.assert_allclose(np.abs(fast).max(axis=1), 48.0)
    np.testing.assert_allclose(fast[:, 0] * slow[:, 1], fast[:, 1] * slow[:, 0], rtol=1e-12)


def test_the_scenario_names_the_drive():
    assert drive_of(scenario(plant="ideal"), ROBOT) == Integrator()
    assert drive_of(scenario(drive={"pwm_levels": 255}), ROBOT) == DifferentialDrive(ROBOT, 255)
    assert drive_of(scenario(drive={"kind": "speed_loop"}), ROBOT) == SpeedDrive(ROBOT)


def test_a_drive_told_too_much_still_moves_the_hand_point_in_the_wanted_direction():
    velocity, heading = random_motion(3)
    pose = np.column_stack([np.zeros((50, 2)), heading])
    voltage = DifferentialDrive(ROBOT).command(100 * velocity, pose)
    assert np.abs(voltage).max(axis=1) == pytest.approx(np.full(50, ROBOT.voltage))
    moved = hand_velocity(voltage / ROBOT.motor_constant, heading)
    cosine = (moved * velocity).sum(axis=1) / np.linalg.norm(moved, axis=1) / np.linalg.norm(velocity, axis=1)
    np.testing.assert_allclose(cosine, 1, atol=1e-12)


def test_integrator_passes_velocities_on_as_a_copy():
    velocity, heading = random_motion(4)
    command = Integrator().command(velocity, heading)
    np.testing.assert_array_equal(command, velocity)
    assert not np.shares_memory(command, velocity)
