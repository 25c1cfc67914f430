"""Commands on their way to the motors."""

from __future__ import annotations

import sys
from collections import deque

import numpy as np

from pbrg_mj.scenario.random_streams import Source, Streams
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.physics_steps import steps_until


class RadioLink:
    """Each command is delayed by itself, robot by robot; none arrives before the one sent before it."""

    def __init__(self, scenario: Scenario):
        """Start with nothing on its way and commands of 0 in force."""
        self._settings = scenario.radio
        self._streams = Streams(scenario.seed, Source.RADIO)
        self._physics_step = scenario.timing.physics_step
        self._delay_steps = steps_until(scenario.radio.delay, self._physics_step)
        self._immediate = not (self._delay_steps or scenario.radio.jitter)
        self._sent = 0
        self._latest = np.zeros(scenario.robots, dtype=np.int64)  # arrival of the last command sent to each robot
        self._in_flight: deque[tuple[np.ndarray, np.ndarray]] = deque()  # arrival step and command of each robot
        self.next_arrival = sys.maxsize  # the step at which something arrives next
        self._held = np.zeros((scenario.robots, 2))

    def send(self, command: np.ndarray, step: int) -> None:
        """Send the commands (n, 2) off at physics step `step`."""
        if self._immediate:
            self._held = command
            return
        # One that is ready waits behind one that is not: no command overtakes.
        self._latest = np.maximum(self._latest, step + self._delays())
        self._in_flight.append((self._latest, command))
        self.next_arrival = min(self.next_arrival, int(self._latest.min()))
        self._sent += 1

    def received(self, step: int) -> np.ndarray:
        """Return the commands (n, 2) in force at physics step `step`: the same array until one arrives."""
        if step >= self.next_arrival:
            self._deliver(step)
        return self._held

    def _deliver(self, step: int) -> None:
        held = self._held.copy()
        for arrival, command in self._in_flight:
            held[arrival <= step] = command[arrival <= step]
        self._held = held
        while self._in_flight and self._in_flight[0][0].max() <= step:
            self._in_flight.popleft()
        coming = [int(arrival[arrival > step].min()) for arrival, _ in self._in_flight if arrival.max() > step]
        self.next_arrival = min(coming, default=sys.maxsize)

    def _delays(self) -> int | np.ndarray:
        """Return how many steps the commands that are sent now take, to all robots or to each, (n,)."""
        delay, jitter = self._settings.delay, self._settings.jitter
        if not jitter:
            return self._delay_steps
        robots = range(len(self._held))
        drawn = [delay + jitter * self._streams.at(robot, self._sent).random() for robot in robots]
        return np.array([steps_until(seconds, self._physics_step) for seconds in drawn])
