"""What a robot knows of its own motion between its last known position and where its commands will have taken it.

Motors of time constant tau follow a commanded velocity u, held for a tick h, by dv/dt = (u - v) / tau. With a =
exp(-h / tau) and w = tau v [m], the way that a robot still rolls after a command of 0, this is exactly

    w+ = a w + tau (1 - a) u,    the displacement in the tick is  (1 - a) w + (h - tau (1 - a)) u.

A known position is d ticks old when a command that follows from it takes effect. A robot does not measure w, nor its
displacements in these d ticks: it computes both from its own commands. It takes the velocity of its hand point in the
world to lag like a wheel's: exact for straight lines, while the turning of the body is neglected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.schema import Camera, Radio, Scenario
from pbrg_mj.world.scene.robot import load_robot_model


@dataclass(frozen=True)
class MotorLag:
    """Lag of the motors and delay between them and the poses, and how a robot computes its own motion from them."""

    time_constant: float  # tau [s]; 0: none
    delay: int  # d [ticks]
    tick: float  # h [s]

    @classmethod
    def of(cls, scenario: Scenario) -> MotorLag:
        """Return those of a scenario: the nominal motors, the assumed delay of poses, the mean delay of commands."""
        camera, radio = scenario.assumed_sensors.camera, scenario.radio
        late = latency(None if scenario.sensors.odometry.fuse else camera, radio)
        robot, tick = load_robot_model(scenario.robot), scenario.timing.tick
        return cls(robot.time_constant, round(late / tick), tick)

    @property
    def remaining(self) -> float:
        """The share a of w that is left after a tick."""
        return math.exp(-self.tick / self.time_constant) if self.time_constant > 0.0 else 0.0

    @property
    def rolled(self) -> float:
        """What a tick of a command adds to w per velocity, tau (1 - a) [s]."""
        return self.time_constant * (1.0 - self.remaining)

    def at_rest(self, robots: int) -> np.ndarray:
        """Return the motion of robots at rest, (n, 1 + d, 2) [m]: w, then the displacements, the latest first."""
        return np.zeros((robots, 1 + self.delay, 2))

    def after(self, motion: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the motion (n, 1 + d, 2) [m] a tick later under commands (n, 2) [m/s]; rows are private to robots."""
        later = np.empty_like(motion)
        later[:, 0] = self.remaining * motion[:, 0] + self.rolled * velocity
        later[:, 2:] = motion[:, 1:-1]
        if self.delay:
            later[:, 1] = (1.0 - self.remaining) * motion[:, 0] + (self.tick - self.rolled) * velocity
        return later


def latency(camera: Camera | None, radio: Radio) -> float:
    """Return how old a pose is on average when a command that follows from it reaches the motors [s].

    None for the camera: poses are predicted to the tick at which they are used.
    """
    poses = 0.0 if camera is None else camera.delay + 0.5 / camera.rate_hz
    return poses + radio.delay + 0.5 * radio.jitter


def motor_lag(scenario: Scenario) -> MotorLag | None:
    """Return what `governor.predicted_motion` asks for; None for kinematic robots."""
    return MotorLag.of(scenario) if scenario.governor.predicted_motion == "motors" else None
