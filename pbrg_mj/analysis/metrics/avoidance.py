"""Contacts with moving boxes, and which of them the robots could have avoided."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pbrg_mj.analysis.metrics.contacts import onsets
from pbrg_mj.analysis.metrics.outcome import Outcome
from pbrg_mj.analysis.metrics.reachable import STEP, avoidable
from pbrg_mj.analysis.metrics.settling import CLOCK_ROUNDING
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import signed_distance
from pbrg_mj.world.scene.obstacles import moving_footprints


class MovingContact(NamedTuple):
    """The first contact of a robot with a moving box."""

    time: float  # [s]
    robot: int  # from 0
    box: int  # from 0
    avoidable: bool


class MovingContactTotals:
    """Where robots were, a sample every `STEP`, and when they touched moving boxes."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._times: list[float] = []
        self._hands: list[np.ndarray] = []
        self._touched: list[tuple[float, int, np.ndarray]] = []  # when, who, where the hand point was
        self._last: np.ndarray | None = None  # flags of the last tick

    def add(self, ticks: TickSeries) -> None:
        """Take the next ticks, one or more."""
        self.add_arrays(ticks.time, ticks.hand_true, ticks.moving_contact)

    def add_arrays(self, time: np.ndarray, hand: np.ndarray, touching: np.ndarray) -> None:
        """Take the next ticks: times (T,) [s], true hand points (T, n, 2) [m], who touches a moving box (T, n)."""
        if not self._scenario.world.moving_boxes:
            return
        for tick, at in enumerate(time.tolist()):
            if not self._times or at > self._times[-1] + STEP - CLOCK_ROUNDING:
                self._times.append(at)
                self._hands.append(hand[tick].copy())
        before = np.zeros_like(touching[0]) if self._last is None else self._last
        for tick, robot in onsets(np.concatenate([before[None], touching])):
            if tick > 0:
                self._touched.append((float(time[tick - 1]), robot, hand[tick - 1, robot].copy()))
        self._last = touching[-1].copy()

    def first_contacts(self) -> list[MovingContact]:
        """Return the first contact of each robot with each box, in order of time.

        A robot that could have kept off a box to the end was not there to be touched again, so first contacts tell of
        all.
        """
        boxes = self._scenario.world.moving_boxes
        found: dict[tuple[int, int], MovingContact] = {}
        time, hand = np.array(self._times), np.array(self._hands)
        for at, robot, place in self._touched:
            box = int(signed_distance(place[None], moving_footprints(boxes, at))[0].argmin())
            if (robot, box) not in found:
                could = avoidable(self._scenario, boxes[box], (time, hand[:, robot]), at)
                found[robot, box] = MovingContact(at, robot, box, could)
        return list(found.values())


def with_avoidance(ended: Outcome, met: list[MovingContact]) -> Outcome:
    """Return the outcome, its reason with the words for a contact that no motion avoids."""
    first = next((one for one in met if ended.robot == one.robot + 1 and ended.time == one.time), None)
    if first is None or ended.kind != "moving" or first.avoidable:
        return ended
    return replace(ended, reason=f"{ended.reason} that no motion avoids")
