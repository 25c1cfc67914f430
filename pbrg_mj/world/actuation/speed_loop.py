"""A wheel-speed loop on board: proportional-integral with feed-forward, at the rate of the physics.

The motor with its share of the robot is J dw/dt = k (V - K w) - friction, with k = K / R and so the mechanical time
constant tau_m = J R / K^2. With V = K w* + kp (w* - w) + integral of ki (w* - w), kp = K (tau_m / tau - 1) makes the
proportional loop's time constant tau, and ki = kp_total / (4 tau) puts both poles at -1 / (2 tau): critically damped.
tau is 10 ms, five of the longest physics steps: a wheel in the air or slipping has a fifth of J, and must stay stable.

It is not MuJoCo's own controller of the dcmotor: that one has an integral over positions alone, and neither the duty
cycles of a motor driver nor a motor cut off can stand between it and the winding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.world.actuation.motor_driver import quantise
from pbrg_mj.world.scene.robot import RobotModel

TIME_CONSTANT = 0.01  # tau [s]


@dataclass(frozen=True)
class SpeedLoop:
    """Gains and limits of all wheels' loops."""

    feed_forward: float  # K [V s/rad]
    proportional: float  # kp [V s/rad]
    integral: float  # ki [V/rad]
    supply: float  # largest voltage [V]
    pwm_levels: int  # duty cycles each way; 0: any
    step: float  # [s]

    def voltage(
        self, reference: np.ndarray, speed: np.ndarray, integral_voltage: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return voltages and the integral parts [V] after this step, all (n, 2), for speeds (n, 2) [rad/s].

        The integral waits while the supply is exhausted, unless that takes it back (no wind-up).
        """
        error = reference - speed
        unsaturated = self.feed_forward * reference + self.proportional * error + integral_voltage
        free = (np.abs(unsaturated) <= self.supply) | (unsaturated * error < 0)
        integral_voltage = integral_voltage + self.integral * self.step * np.where(free, error, 0.0)
        return quantise(np.clip(unsaturated, -self.supply, self.supply), self.supply, self.pwm_levels), integral_voltage


def speed_loop(robot: RobotModel, step: float, pwm_levels: int) -> SpeedLoop:
    """Return the loop of a robot's wheels at a physics step [s], gains as derived above."""
    K, tau = robot.motor_constant, TIME_CONSTANT
    tau_m = robot.driven_inertia * robot.no_load_speed / robot.stall_torque
    return SpeedLoop(
        feed_forward=K,
        proportional=K * (tau_m / tau - 1),
        integral=K * tau_m / tau / (4 * tau),
        supply=robot.voltage,
        pwm_levels=pwm_levels,
        step=step,
    )
