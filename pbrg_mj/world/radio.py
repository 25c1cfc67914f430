"""Commands on their way to the motors."""

from __future__ import annotations

from collections import deque

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.streams import Source, stream
from pbrg_mj.world.sampling import steps_until


class RadioLink:
    """One queue per robot. Each command is delayed by itself, none arrives before the one sent before it."""

    def __init__(self, scenario: Scenario):
        """Start with nothing on its way and commands of 0 in force."""
        self._settings = scenario.radio
        self._seed = scenario.seed
        self._physics_step = scenario.timing.physics_step
        self._sent = 0
        self._queues: list[deque[tuple[int, np.ndarray]]] = [deque() for _ in range(scenario.robots)]
        self._held = np.zeros((scenario.robots, 2))

    def send(self, command: np.ndarray, step: int) -> None:
        """Send the commands (n, 2) off at physics step `step`."""
        for robot, queue in enumerate(self._queues):
            arrival = step + steps_until(self._travel(robot), self._physics_step)
            queue.append((arrival, command[robot].copy()))
        self._sent += 1

    def received(self, step: int) -> np.ndarray:
        """Return the commands (n, 2) in force at physics step `step`; steps may not go back."""
        for robot, queue in enumerate(self._queues):
            # One that is ready waits behind one that is not: no command overtakes.
            while queue and queue[0][0] <= step:
                self._held[robot] = queue.popleft()[1]
        return self._held.copy()

    def _travel(self, robot: int) -> float:
        """Return how long the command that is sent now takes to a robot [s]."""
        delay, jitter = self._settings.delay, self._settings.jitter
        if not jitter:
            return delay
        return delay + jitter * stream(self._seed, Source.RADIO, robot, self._sent).random()
