"""Hand-point control: a point ahead of the axle moves in any direction, so it can be driven like an integrator.

With c the axle's centre, theta the heading, b the hand offset, e = (cos theta, sin theta) and
e' = (-sin theta, cos theta):

    q = c + b e,    dq/dt = v e + b omega e'    =>    v = e . dq/dt,    omega = e' . dq/dt / b

This is input-output feedback linearisation of the unicycle: De Luca, Oriolo and Vendittelli, "Control of wheeled
mobile robots: an experimental overview", 2001.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.world.robot import RobotModel


def hand_point(body_pose: np.ndarray, hand_offset: float) -> np.ndarray:
    """Return the hand points q (n, 2) [m] of body poses (n, 3) x, y [m], heading [rad]."""
    return body_pose[:, :2] + hand_offset * _ahead(body_pose[:, 2])


def wheel_speeds(velocity: np.ndarray, heading: np.ndarray, robot: RobotModel) -> np.ndarray:
    """Return the wheel speeds (n, 2) left, right [rad/s] that give hand points the `velocity` (n, 2) [m/s]."""
    e = _ahead(heading)
    v = np.sum(e * velocity, axis=1)
    omega = (e[:, 0] * velocity[:, 1] - e[:, 1] * velocity[:, 0]) / robot.hand_offset
    turn = omega * robot.track / 2
    return np.column_stack([v - turn, v + turn]) / robot.wheel_radius


def hand_velocity(wheel_speed: np.ndarray, heading: np.ndarray, robot: RobotModel) -> np.ndarray:
    """Return the velocities (n, 2) [m/s] of hand points whose wheels (n, 2) left, right [rad/s] roll without slip."""
    e = _ahead(heading)
    rim = robot.wheel_radius * wheel_speed
    v, omega = rim.mean(axis=1), (rim[:, 1] - rim[:, 0]) / robot.track
    across = np.column_stack([-e[:, 1], e[:, 0]])
    return v[:, None] * e + robot.hand_offset * omega[:, None] * across


def _ahead(heading: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(heading), np.sin(heading)])
