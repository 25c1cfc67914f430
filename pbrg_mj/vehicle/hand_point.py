"""Hand-point control: a point ahead of the axle moves in any direction, so it can be driven like an integrator.

With c the axle's centre, theta the heading, b the hand offset, e = (cos theta, sin theta) and
e' = (-sin theta, cos theta):

    q = c + b e,    dq/dt = v e + b omega e'    =>    v = e . dq/dt,    omega = e' . dq/dt / b

This is input-output feedback linearisation of the unicycle: De Luca, Oriolo and Vendittelli, "Control of wheeled
mobile robots: an experimental overview", 2001.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.world.scene.robot import RobotModel


def hand_point(body_pose: np.ndarray, hand_offset: float) -> np.ndarray:
    """Return the hand points q (n, 2) [m] of body poses (n, 3) x, y [m], heading [rad]."""
    q = np.empty((len(body_pose), 2))
    write_hand_points(body_pose, hand_offset, q)
    return q


def wheel_speeds(velocity: np.ndarray, heading: np.ndarray, robot: RobotModel) -> np.ndarray:
    """Return the wheel speeds (n, 2) left, right [rad/s] that give hand points the `velocity` (n, 2) [m/s]."""
    return wheel_speeds_of(velocity, heading, robot_dimensions(robot))


def robot_dimensions(robot: RobotModel) -> tuple[float, float, float]:
    """Return hand offset, half the track and the wheels' radius [m]."""
    return robot.hand_offset, robot.track / 2, robot.wheel_radius


def omnidirectional_wheel_speeds(velocity: np.ndarray, heading: np.ndarray, wheel_radius: float) -> np.ndarray:
    """Return the wheel speeds (n, 2) ahead, aside [rad/s] of omnidirectional bases at the `velocity` (n, 2) [m/s]."""
    e = np.column_stack([np.cos(heading), np.sin(heading)])
    aside = e[:, 0] * velocity[:, 1] - e[:, 1] * velocity[:, 0]
    return np.column_stack([np.sum(e * velocity, axis=1), aside]) / wheel_radius


@kernel
def write_hand_points(body_pose, hand_offset, q):
    """Write what `hand_point` returns to q (n, 2), of `body_pose` (n, 3)."""
    for j in range(len(body_pose)):
        heading = body_pose[j, 2]
        q[j, 0] = body_pose[j, 0] + hand_offset * math.cos(heading)
        q[j, 1] = body_pose[j, 1] + hand_offset * math.sin(heading)


@kernel
def wheel_speeds_of(velocity, heading, sizes):
    """Compute what `wheel_speeds` returns, of `velocity` (n, 2) [m/s] and `heading` (n,) [rad].

    `sizes` are `robot_dimensions`: hand_offset, half_track, wheel_radius [m].
    """
    hand_offset, half_track, wheel_radius = sizes
    speeds = np.empty((len(velocity), 2))
    for j in range(len(velocity)):
        e_x, e_y = math.cos(heading[j]), math.sin(heading[j])
        v = e_x * velocity[j, 0] + e_y * velocity[j, 1]
        omega = (e_x * velocity[j, 1] - e_y * velocity[j, 0]) / hand_offset
        turn = omega * half_track
        speeds[j, 0], speeds[j, 1] = (v - turn) / wheel_radius, (v + turn) / wheel_radius
    return speeds
