"""What metrics say of safety, contacts and the network's load, summed up over a run's ticks a block at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.contacts import FIELDS, onsets
from pbrg_mj.analysis.metrics.margins import true_margin
from pbrg_mj.analysis.metrics.per_tick import (
    integral_state,
    least_sensed_margin,
    robot_distance,
    sensing,
    sent_per_robot,
)
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.exchange import StateMessages


class SafetyTotals:
    """Least margins, largest states, contacts."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._least: dict[str, float] = dict.fromkeys(("true", "moving", "sensed", "robots"), math.inf)
        self._xi = -math.inf
        self._sensed_at = math.nan
        self._winding_up = 0
        self._last: dict[str, np.ndarray] = {}  # flags of the last tick
        self._onsets, self._touching = dict.fromkeys(FIELDS, 0), dict.fromkeys(FIELDS, 0)

    def add(self, ticks: TickSeries) -> None:
        """Take the next ticks, one or more."""
        scenario = self._scenario
        self._lower("true", true_margin(ticks, scenario))
        self._lower("moving", ticks.moving_margin)
        self._lower("sensed", least_sensed_margin(ticks, scenario))
        self._lower("robots", robot_distance(ticks, scenario))
        self._xi = float(np.maximum(self._xi, integral_state(ticks, scenario).max()))  # NaN if one is
        self._winding_up += int(np.count_nonzero(ticks.winding_up.any(axis=1)))
        known = np.flatnonzero(sensing(ticks, scenario))
        if len(known) and math.isnan(self._sensed_at):
            self._sensed_at = float(ticks.time[known[0]])
        for kind, field in FIELDS.items():
            flags = getattr(ticks, field)
            before = self._last[kind] if kind in self._last else np.zeros_like(flags[0])
            self._onsets[kind] += len(onsets(np.concatenate([before[None], flags]))) - int(np.count_nonzero(before))
            self._touching[kind] += int(np.count_nonzero(flags.any(axis=1)))
            self._last[kind] = flags[-1].copy()

    def fields(self, absent: frozenset[str]) -> dict[str, Any]:
        """Return the metrics by name; `absent` are the fields that the log is too old to have."""
        tick = self._scenario.timing.tick
        found: dict[str, Any] = {
            "true_margin_min_m": self._least["true"],
            "moving_margin_min_m": self._least["moving"],
            "robot_gap_min_m": self._robot_gap(),
            "sensed_margin_min_m": self._least["sensed"],
            "first_half_space_s": self._sensed_at,
            "xi_max_m": self._xi,
            "winding_up_s": self._winding_up * tick,
        }
        for kind, field in FIELDS.items():
            known = field not in absent
            found[f"{field}s"] = self._onsets[kind] if known else None
            found[f"{field}_s"] = self._touching[kind] * tick if known else math.nan
        return found

    def _robot_gap(self) -> float:
        """Return the least distance between the bodies of two robots [m]; NaN for one robot alone.

        Bodies are discs of the robot's radius: 0 is contact. The ideal plant's robots are points; theirs trail them.
        """
        diameter = 2 * robot_size(self._scenario.robot).body_radius
        return float(self._least["robots"]) - diameter if self._scenario.robots > 1 else math.nan

    def _lower(self, name: str, values: np.ndarray) -> None:
        self._least[name] = float(np.minimum(self._least[name], values.min()))  # NaN if one is


class NetworkTotals:
    """Rounds and bytes."""

    def __init__(self, scenario: Scenario):
        self._scenario, self._states = scenario, StateMessages.of(scenario)
        self._ticks, self._rounds, self._sent, self._states_sent = 0, 0, 0.0, 0.0

    def add(self, ticks: TickSeries) -> None:
        """Take the next ticks."""
        self._states_sent += float(self._states.sent(self._ticks, len(ticks.rounds)).mean(axis=1).sum())
        self._ticks += len(ticks.rounds)
        self._rounds += float(ticks.rounds.sum(dtype=float))
        self._sent += float(sent_per_robot(ticks, self._scenario).sum())

    def fields(self, centralized: bool) -> dict[str, float]:
        """Return the metrics by name; what a centralized governor says of messages nobody has counted."""
        sent = math.nan if centralized else self._sent
        return {
            "rounds_per_tick": self._rounds / self._ticks,
            "sent_per_robot_per_tick_bytes": sent / self._ticks,
            "sent_per_robot_per_second_bytes": sent / self._ticks / self._scenario.timing.tick,
            "sent_per_robot_total_bytes": sent,
            "pre_stabiliser_per_robot_per_tick_bytes": self._states_sent / self._ticks,
        }
