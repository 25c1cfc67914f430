"""How large a step kappa of an advance keeps every robot's predicted way within what it has seen.

While m is held, position j moves by (E_j(t) - E_j(0)) e within t ticks; the step kappa of an advance d adds
kappa s_j(t) d. No robot with beams is to go farther than it sees, in any direction:

    ||(E_j(t) - E_j(0)) e + kappa s_j(t) d|| <= sight    at every t of the prediction.

A wall that stands still then comes into view before it is on the way: its half-space holds the disc of radius `sight`
round the hand point, and with it all positions that are predicted while m is held. So a wall seen late asks for no
retreat, which motors at their limit could not do. A way that is too long already may not grow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid, write_times_error
from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.robot import RobotModel

SCANS = 2  # that show a wall before it counts: perception.track.confirmation


@dataclass(frozen=True)
class SightLimit:
    """Rows of predicted ways, for the robots that carry beams."""

    columns: np.ndarray  # (n, N, K) of the prediction grid's E
    s: np.ndarray  # (n, K)
    robots: np.ndarray  # (R,) that carry beams
    sight: float  # [m]

    @classmethod
    def of(cls, grid: PredictionGrid, robots: np.ndarray, sight: float) -> SightLimit:
        """Return the rows of a grid for the `robots` (R,) that see so far [m]."""
        return cls(grid.columns, grid.s, robots, sight)

    def kappa(self, error: np.ndarray, heading: np.ndarray, advance: np.ndarray) -> float:
        """Return the largest kappa in [0, 1] for an advance (2,) [m].

        `error` (N, 2) [m] is x - (m, 0) at the held m; `heading` is that of the other limits, not needed here.
        """
        return sight_kappa(self.rows, error, advance)

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """What `sight_kappa` takes: columns of E, s, robots, sight."""
        return self.columns, self.s, self.robots, self.sight


def sight(scenario: Scenario, robot: RobotModel) -> float:
    """Return how far a hand point may go before a wall that is out of sight now can be on its way [m].

    A wall counts once `estimator.thresholds.long_extent` of it is in range, in `SCANS` scans. Meanwhile a robot drives
    on, at most at its wheels' speed. Negative where beams are too short for that.
    """
    beams, extent = scenario.sensors.beams, scenario.estimator.thresholds.long_extent
    reach = math.sqrt(max(beams.range_max**2 - (extent / 2) ** 2, 0.0))
    passed = SCANS / beams.rate_hz * robot.loaded_speed * robot.wheel_radius
    return reach - robot.hand_offset - robot.clearance - passed


@kernel
def sight_kappa(rows, error, advance):
    """Compute `SightLimit.kappa` of `error` (N, 2) and `advance` (2,) [m].

    `rows` are `SightLimit.rows`: columns (n, N, K) of E, s (n, K), the robots (R,) that carry beams, sight [m].
    """
    columns, s, robots, sight = rows
    if advance[0] == 0.0 and advance[1] == 0.0:
        return 1.0
    kappa, points = 1.0, s.shape[1]
    moved = np.empty((2, points))
    for j in robots:
        write_times_error(columns, j, error, moved)
        for k in range(1, points):
            x, y = moved[0, k] - moved[0, 0], moved[1, k] - moved[1, 0]
            dx, dy = s[j, k] * advance[0], s[j, k] * advance[1]
            last = x * x + y * y - sight * sight
            half, first = x * dx + y * dy, dx * dx + dy * dy
            if max(last, last + 2.0 * half + first) <= 0.0 or first <= 0.0:
                continue
            if last > 0.0:  # beyond already: no farther than it is
                kappa = min(kappa, max(-2.0 * half / first, 0.0))
            else:
                kappa = min(kappa, (math.sqrt(half * half - first * last) - half) / first)
    return kappa
