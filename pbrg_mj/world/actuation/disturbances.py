"""Pushes and dead motors, at the resolution of physics steps."""

from __future__ import annotations

import sys
from bisect import bisect_right

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.physics_steps import steps_during
from pbrg_mj.world.scene.robot import WHEELS


class Disturbances:
    """The pushes and dead motors of a scenario, step by step."""

    def __init__(self, scenario: Scenario):
        """Turn the scenario's seconds into physics steps."""
        self._robots, step = scenario.robots, scenario.timing.physics_step
        self._pushes = [
            (steps_during(push.time, push.duration, step), push.robot - 1, np.array(push.force))
            for push in scenario.disturbances.pushes
        ]
        self._dead_motors = [
            (steps_during(motor.time, motor.duration, step), motor.robot - 1, WHEELS.index(motor.side))
            for motor in scenario.disturbances.dead_motors
        ]
        ranges = [steps for steps, *_ in (*self._pushes, *self._dead_motors)]
        self._changes = sorted({end for steps in ranges for end in (steps.start, steps.stop)})

    def next_change(self, step: int) -> int:
        """Return the first step after `step` at which something starts or ends."""
        later = bisect_right(self._changes, step)
        return self._changes[later] if later < len(self._changes) else sys.maxsize

    @property
    def pushing(self) -> bool:
        """Whether there is any push in the whole run."""
        return bool(self._pushes)

    def force(self, step: int) -> np.ndarray:
        """Return the forces (n, 2) [N], in the world, on the robots' bodies during `step`; pushes add up."""
        force = np.zeros((self._robots, 2))
        for steps, robot, push in self._pushes:
            if step in steps:
                force[robot] += push
        return force

    def without_dead_motors(self, voltage: np.ndarray, step: int) -> np.ndarray:
        """Return the voltages (..., n, 2) [V] that are left during `step`: 0 at dead motors."""
        if not self._dead_motors:
            return voltage
        dead = [(robot, side) for steps, robot, side in self._dead_motors if step in steps]
        if dead:
            voltage = voltage.copy()
            robots, sides = np.transpose(dead)
            voltage[..., robots, sides] = 0.0
        return voltage
