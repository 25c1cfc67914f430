"""What is kept of many worlds' runs."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from pbrg_mj.governor.certificate.evaluate import NAMES
from pbrg_mj.scenario.schema import Scenario, whole_number


@dataclass(frozen=True)
class BatchHistories:
    """What happened in W worlds at T ticks, at the start of each."""

    seeds: tuple[int, ...]
    time: np.ndarray  # (T,) [s]
    hand_world: np.ndarray  # (W, T, n, 2) q, truth [m]
    m: np.ndarray  # (W, T, n, 2) governed references as each robot knows them [m]
    wall_margin: np.ndarray  # (W, T, n) truth: hand point to nearest wall's face, less the clearance [m]
    moving_margin: np.ndarray  # (W, T, n) the same to the nearest moving box where it is [m]
    wall_contact: np.ndarray  # (W, T, n) bool, truth
    moving_contact: np.ndarray  # (W, T, n) bool, truth: with a moving box
    robot_contact: np.ndarray  # (W, T, n) bool, truth: with another robot
    diverged: np.ndarray  # (W, T) bool: the governor's estimates have left all bounds
    certificate_violated: np.ndarray  # (W, T, 3) bool: each of `evaluate.NAMES` at what the leaders apply

    @classmethod
    def empty(cls, scenario: Scenario, seeds: tuple[int, ...]) -> BatchHistories:
        """Return empty arrays for a whole run, in which there are no moving boxes."""
        ticks = whole_number(scenario.timing.duration, scenario.timing.tick) + 1
        shape = (len(seeds), ticks, scenario.robots)
        return cls(
            seeds=seeds,
            time=np.arange(ticks) * scenario.timing.tick,
            hand_world=np.empty((*shape, 2)),
            m=np.empty((*shape, 2)),
            wall_margin=np.empty(shape),
            moving_margin=np.full(shape, np.inf),
            wall_contact=np.empty(shape, dtype=bool),
            moving_contact=np.zeros(shape, dtype=bool),
            robot_contact=np.empty(shape, dtype=bool),
            diverged=np.empty(shape[:2], dtype=bool),
            certificate_violated=np.zeros((*shape[:2], len(NAMES)), dtype=bool),
        )

    def part(self, worlds: slice) -> BatchHistories:
        """Return views of some worlds."""
        views = {field.name: getattr(self, field.name)[worlds] for field in fields(self) if field.name != "time"}
        return BatchHistories(time=self.time, **views)
