"""How fast robots can go and still steer, when what they know of their heading is old.

The heading turns towards the hand point's velocity, dtheta/dt = |u| sin(beta) / offset. Behind a delay T of poses and
commands and motors of time constant tau this is, for small beta, a loop of gain k = |u| / offset,

    k exp(-s T) / (s (1 + s tau)),

which oscillates by itself from k = w sqrt(1 + (w tau)^2) on, w T + atan(w tau) = pi / 2. Faster robots zigzag.
"""

from __future__ import annotations

import math

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.vehicle.motor_lag import latency
from pbrg_mj.world.scene.robot import RobotModel

GAIN_MARGIN = 2.0  # the usual 6 dB
BISECTIONS = 60


def steerable_speed(robot: RobotModel, delay: float) -> float:
    """Return the speed at which the heading's loop behind a delay [s], not 0, has its gain margin [m/s]; or inf."""
    if robot.omnidirectional:
        return math.inf
    low, high = 0.0, math.pi / (2.0 * delay)
    for _ in range(BISECTIONS):
        w = 0.5 * (low + high)
        low, high = (w, high) if w * delay + math.atan(w * robot.time_constant) < math.pi / 2 else (low, w)
    return robot.hand_offset * low * math.hypot(1.0, low * robot.time_constant) / GAIN_MARGIN


def mean_delay(scenario: Scenario) -> float:
    """Return how old a pose is on average when a command that follows from it reaches the motors [s]."""
    return latency(scenario.sensors.camera, scenario.radio)
