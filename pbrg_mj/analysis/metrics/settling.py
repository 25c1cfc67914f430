"""How long a team took to settle, from its ticks a block at a time."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.analysis.metrics.best_formation import best_formation
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario

CLOCK_ROUNDING = 1e-9  # [s] rounding of tick times


def formation_errors(hand: np.ndarray, scenario: Scenario, point: np.ndarray) -> np.ndarray:
    """Return max_j ||q_j - b_j - point|| (T,) [m] of hand points (T, n, 2) [m]."""
    return np.linalg.norm(hand - np.array(scenario.team.formation) - point, axis=-1).max(axis=-1)


class Settling:
    """Since when the formation error at the best admissible formation has stayed within tolerance."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._reference: np.ndarray | None = None  # r at the last tick
        self._point: np.ndarray | None = None
        self._changed = math.nan  # when r took its last value [s]
        self._settled: float | None = None  # [s]
        self._last = math.nan  # tick [s]

    def add(self, ticks: TickSeries) -> None:
        """Take the next ticks. Of the references among them, the last one alone counts."""
        if not len(ticks.time):
            return
        r = ticks.reference
        before = r[:1] if self._reference is None else self._reference[None]
        changed = np.flatnonzero(np.any(np.diff(np.concatenate([before, r]), axis=0) != 0, axis=1))
        first = int(changed[-1]) if len(changed) else 0
        if self._reference is None or len(changed):
            self._point = best_formation(self._scenario, r[-1]).point
            self._changed, self._settled = float(ticks.time[first]), None
        self._reference, self._last = r[-1].copy(), float(ticks.time[-1])
        if self._point is None:
            return
        error = formation_errors(ticks.hand_true[first:], self._scenario, self._point)
        late = np.flatnonzero(~(error <= self._scenario.outcome.tolerance))
        settled = first + (int(late[-1]) + 1 if len(late) else 0)
        if len(late) or self._settled is None:
            self._settled = float(ticks.time[settled]) if settled < len(ticks.time) else None

    def time(self) -> float:
        """Return how long after the last change of r the error stayed within tolerance [s]; NaN if it never did."""
        return math.nan if self._settled is None else max(0.0, self._settled - self._changed)

    def time_held(self, least: float) -> float:
        """Return the same [s]; NaN also unless the error has then stayed within tolerance for `least` [s]."""
        if self._settled is None or self._last - self._settled < least - CLOCK_ROUNDING:
            return math.nan
        return self.time()
