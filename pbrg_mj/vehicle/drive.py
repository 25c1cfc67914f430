"""From velocities of the hand points to what the plant is commanded."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario import schema
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.vehicle.hand_point import omnidirectional_wheel_speeds, robot_dimensions, wheel_speeds, wheel_speeds_of
from pbrg_mj.world.actuation.motor_driver import quantised, saturate, saturated
from pbrg_mj.world.scene.robot import RobotModel

Motor = tuple[float, float, int, float, float]
"""V s/rad, nominal voltage [V], duty cycles each way, compensated friction [V], Stribeck speed [rad/s]."""


class Drive(Protocol):
    """Turns wanted velocities into the plant's commands."""

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return commands (n, 2) for velocities (n, 2) [m/s] of hand points of bodies at (n, 3) [m, m, rad]."""
        ...


@dataclass(frozen=True)
class Integrator:
    """The ideal plant takes velocities as they are."""

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return the velocities (n, 2) [m/s]."""
        return velocity.copy()


@dataclass(frozen=True)
class DifferentialDrive:
    """Open loop, as in the paper: the voltage at which an unloaded, frictionless wheel turns at the wanted speed.

    With `friction` it adds that of the motors' Coulomb friction in the direction of the wanted speed.
    """

    robot: RobotModel
    pwm_levels: int = 0  # duty cycles each way; 0: any
    friction: float = 0.0  # Coulomb friction that is compensated, as a voltage [V]

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return the wheel voltages (n, 2) left, right [V], none beyond the nominal voltage."""
        voltage = np.empty(velocity.shape)
        write_wheel_voltages(velocity, body_pose, *self.parameters, voltage)
        return voltage

    @cached_property
    def parameters(self) -> tuple[tuple[float, float, float], Motor]:
        """Hand offset, half the track and the wheels' radius [m]; the motor."""
        return robot_dimensions(self.robot), motor_of(self.robot, self.pwm_levels, self.friction)


@dataclass(frozen=True)
class OmnidirectionalDrive:
    """The same for an omnidirectional base: voltages of the motors that push ahead and aside."""

    robot: RobotModel
    pwm_levels: int = 0  # duty cycles each way; 0: any
    friction: float = 0.0  # as of DifferentialDrive [V]

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return the voltages (n, 2) ahead, aside [V], none beyond the nominal voltage."""
        robot = self.robot
        speeds = omnidirectional_wheel_speeds(velocity, body_pose[:, 2], robot.wheel_radius)
        return motor_voltages(speeds, motor_of(robot, self.pwm_levels, self.friction))


@dataclass(frozen=True)
class SpeedDrive:
    """The wanted wheel speeds, for the loop on board; no wheel is asked for more than it can do."""

    robot: RobotModel

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return the speeds (n, 2) of both inputs [rad/s], none beyond what the motor does against its friction."""
        robot, heading = self.robot, body_pose[:, 2]
        if robot.omnidirectional:
            return saturate(omnidirectional_wheel_speeds(velocity, heading, robot.wheel_radius), robot.loaded_speed)
        return saturate(wheel_speeds(velocity, heading, robot), robot.loaded_speed)


def motor_of(robot: RobotModel, pwm_levels: int, friction: float) -> Motor:
    """Return what `motor_voltages` needs; `friction` is the voltage that is compensated."""
    return robot.motor_constant, robot.voltage, pwm_levels, friction, robot.stribeck_speed


@kernel
def write_wheel_voltages(velocity, body_pose, sizes, motor, voltage):
    """Write what DifferentialDrive commands to `voltage` (n, 2), of `velocity` (n, 2) and `body_pose` (n, 3).

    `sizes` and `motor` are its parameters.
    """
    found = motor_voltages(wheel_speeds_of(velocity, body_pose[:, 2], sizes), motor)
    for j in range(len(found)):
        voltage[j, 0], voltage[j, 1] = found[j, 0], found[j, 1]


@kernel
def motor_voltages(speeds, motor):
    """Return the voltages (n, 2) of wanted speeds (n, 2) [rad/s].

    `motor` are the members of `Motor`: constant [V s/rad], supply [V], levels of the PWM each way (0: continuous),
    friction [V] that is compensated, stribeck [rad/s]. The voltage against friction grows with the speed up to the
    Stribeck speed, below which friction is not yet that of Coulomb: so noise about 0 turns no wheel. What is wanted
    beyond what is left of the supply is scaled down to that.
    """
    constant, supply, levels, friction, stribeck = motor
    voltage = saturated(constant * speeds, supply - friction)
    if friction:
        for j in range(len(voltage)):
            for side in range(2):
                share = voltage[j, side] / (constant * stribeck)
                voltage[j, side] += friction * min(max(share, -1.0), 1.0)
    return quantised(voltage, supply, levels) if levels else voltage


def drive_of(scenario: Scenario, robot: RobotModel) -> Drive:
    """Return the drive that the scenario's plant and `drive.kind` name."""
    if scenario.plant == "ideal":
        return Integrator()
    if scenario.drive.kind == "speed_loop":
        return SpeedDrive(robot)
    drive = OmnidirectionalDrive if robot.omnidirectional else DifferentialDrive
    return drive(robot, scenario.drive.pwm_levels, compensated_friction(scenario.drive, robot))


def compensated_friction(drive: schema.Drive, robot: RobotModel) -> float:
    """Return the voltage of the motors' Coulomb friction if the drive makes up for it, 0 else [V].

    Friction beyond the stall torque is made up for by none. That of a floor is not known to the robots.
    """
    torque = drive.friction * robot.coulomb_torque if drive.friction_compensation else 0.0
    return torque / robot.stall_torque * robot.voltage if torque < robot.stall_torque else 0.0
