"""From velocities of the hand points to what the plant is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pbrg_mj.vehicle.hand_point import wheel_speeds
from pbrg_mj.world.robot import RobotModel


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
    """Open loop, as in the paper: the voltage at which an unloaded, frictionless wheel turns at the wanted speed."""

    robot: RobotModel

    def command(self, velocity: np.ndarray, body_pose: np.ndarray) -> np.ndarray:
        """Return the wheel voltages (n, 2) left, right [V], none beyond the nominal voltage."""
        speed = wheel_speeds(velocity, body_pose[:, 2], self.robot)
        return saturate(self.robot.motor_constant * speed, self.robot.voltage)


def saturate(voltage: np.ndarray, limit: float) -> np.ndarray:
    """Scale each robot's pair of voltages (n, 2) down to `limit`, so that a fast robot keeps its direction."""
    largest = np.abs(voltage).max(axis=1, keepdims=True)
    return voltage * (limit / np.maximum(largest, limit))
