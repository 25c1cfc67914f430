"""The robots' own motion behind motors, from what a log has: the commands, tick by tick (`vehicle.motor_lag`)."""

from __future__ import annotations

import numpy as np

from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.vehicle.motor_lag import motor_lag


class LoggedMotion:
    """Takes ticks from the first on, a block at a time."""

    def __init__(self, scenario: Scenario):
        self._lag = motor_lag(scenario)
        self._motion: np.ndarray | None = None  # at the last tick
        self._velocity = self._displaced = np.empty(0)  # of the last tick

    def of(self, ticks: TickSeries) -> np.ndarray | None:
        """Return the motion (T, n, 1 + d, 2) [m] at these ticks; None for kinematic robots."""
        if self._lag is None:
            return None
        found, displaced = [], ticks.hand - ticks.p  # by separation, but for the formation
        for t in range(len(displaced)):
            if self._motion is None:
                self._motion = self._lag.at_rest(displaced.shape[1])
            else:  # p moves by the velocity before filters
                change = (displaced[t] - self._displaced) / self._lag.tick
                self._motion = self._lag.after(self._motion, self._velocity - change)
            self._velocity, self._displaced = ticks.velocity[t], displaced[t]
            found.append(self._motion)
        return np.array(found).reshape(-1, *self._lag.at_rest(displaced.shape[1]).shape)
