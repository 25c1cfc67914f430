"""The motor and its friction against closed forms, on a robot whose wheels hang free."""

import mujoco
import numpy as np
import pytest

from pbrg_mj.world.scene.robot import load_arena, load_robot, load_robot_model

ROBOT = load_robot_model()
BREAKAWAY = ROBOT.voltage * ROBOT.static_torque / ROBOT.stall_torque  # [V]


@pytest.fixture(scope="module")
def lifted() -> mujoco.MjModel:
    arena, robot = load_arena(), load_robot()
    robot.delete(robot.joint("free"))
    arena.attach(robot, prefix="robot/", frame=arena.worldbody.add_frame(pos=[0, 0, 0.5]))
    return arena.compile()


def spin(model: mujoco.MjModel, voltage: float, seconds: float) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.ctrl[:] = voltage
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return data


def test_the_numbers_read_are_the_numbers_written():
    assert (ROBOT.voltage, ROBOT.track, ROBOT.hand_offset, ROBOT.wheel_radius) == (6, 0.1, 0.04, 0.02)
    assert (ROBOT.stall_torque, ROBOT.no_load_speed) == (pytest.approx(0.05), pytest.approx(50))
    assert (ROBOT.coulomb_torque, ROBOT.static_torque, ROBOT.stribeck_speed) == (0.002, 0.003, 0.3)
    assert (ROBOT.bristle_stiffness, ROBOT.bristle_damping, ROBOT.mass) == (2, 0.01, pytest.approx(0.4))
    assert ROBOT.clearance == pytest.approx(0.1)


@pytest.mark.parametrize("voltage", [1.0, 2.0, 4.0, 6.0, -3.0])
def test_steady_speed_follows_the_voltage(lifted, voltage):
    """Torque balance: stall (V / Vn - w / w0) = coulomb, once w is far above the Stribeck speed."""
    w = ROBOT.no_load_speed * (abs(voltage) / ROBOT.voltage - ROBOT.coulomb_torque / ROBOT.stall_torque)
    np.testing.assert_allclose(spin(lifted, voltage, 2.0).qvel, np.copysign(w, voltage), rtol=1e-3)


def test_stall_torque_is_the_nominal_one(lifted):
    data = mujoco.MjData(lifted)
    data.ctrl[:] = ROBOT.voltage
    mujoco.mj_forward(lifted, data)
    np.testing.assert_allclose(data.qfrc_actuator, ROBOT.stall_torque, rtol=1e-9)


def test_a_wheel_breaks_away_at_the_static_torque(lifted):
    """Ramp the voltage slowly. LuGre bristles yield a little below their limit; a wheel that has broken away turns."""
    data = mujoco.MjData(lifted)
    rise = BREAKAWAY * lifted.opt.timestep / 20  # per step: from rest to breakaway in 20 s
    while data.qvel.min() < 0.03 and data.ctrl[0] < 2 * BREAKAWAY:
        data.ctrl[:] += rise
        mujoco.mj_step(lifted, data)
    assert data.ctrl[0] == pytest.approx(BREAKAWAY, rel=0.02)


def creep(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Return the fastest mean speed of a wheel over the next two seconds [rad/s]."""
    before = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=1000)
    return float(np.abs(data.qpos - before).max() / (1000 * model.opt.timestep))


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9, -0.7])
def test_a_wheel_does_not_creep_below_breakaway(lifted, share):
    assert creep(lifted, spin(lifted, share * BREAKAWAY, 1.0)) < 1e-6


def test_a_voltage_that_rises_slowly_is_held_where_a_step_overshoots(lifted):
    """A step makes the bristles overshoot; a wheel that then turns at 0.3 rad/s slips."""
    data = mujoco.MjData(lifted)
    for share in np.linspace(0, 0.95, 500):
        data.ctrl[:] = share * BREAKAWAY
        mujoco.mj_step(lifted, data)
    mujoco.mj_step(lifted, data, nstep=500)
    assert creep(lifted, data) < 1e-6
    assert creep(lifted, spin(lifted, 0.95 * BREAKAWAY, 1.0)) > 0.1


def test_a_spun_wheel_only_loses_energy_at_zero_volts(lifted):
    data = mujoco.MjData(lifted)
    data.qvel[:] = 40.0
    kinetic = []
    for _ in range(500):
        mujoco.mj_step(lifted, data)
        kinetic.append((data.qvel**2 * lifted.dof_M0).sum() / 2)
    lowest = np.minimum.accumulate(kinetic)
    # What the two wheels' bristles took, they may give back once; no more.
    stored = 2 * ROBOT.static_torque**2 / (2 * ROBOT.bristle_stiffness)
    assert (kinetic - lowest).max() <= stored
    assert np.diff(kinetic[: np.argmax(np.array(kinetic) < stored)]).max() < 0
    assert kinetic[-1] < 1e-9 * kinetic[0]
