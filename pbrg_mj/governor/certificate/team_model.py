"""The pre-stabilised team under a constant governed reference, as the benchmark runs it: eq. 9, sampled.

The two coordinates of the plane decouple. For one of them, x = (p, xi) in R^2n moves from tick to tick by

    x(t + 1) = A x(t) + b y,    A = I + h [[-(L + alpha_r D), L], [-L, -leak L]],    b = h alpha_r (delta, 0)

where y is that coordinate of m. (y 1, 0) is its fixed point, so x - (y 1, 0) moves by A alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pbrg_mj.scenario.schema import Control, Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import continuous_map, sampled_map, zero_sum

DECAY = 1e-3  # of the error's norm, by which a prediction may end
MOST_GROWING = 2000  # ticks in which a stable team's error has begun to fall
MOST_TICKS = 1 << 20  # of a prediction; a team that needs more hardly moves


@dataclass(frozen=True)
class TeamModel:
    """One coordinate of the team under constant m."""

    step: np.ndarray  # (2n, 2n) A
    rate: np.ndarray  # (n, 2n) maps the error x - (y 1, 0) to the velocities u [1/s]
    tick: float  # h [s]

    @classmethod
    def of(cls, team: Network, control: Control, tick: float) -> TeamModel:
        """Return the model of a team with the gains of eq. 2."""
        return cls(sampled_map(team, control, tick), continuous_map(team, control)[: team.robots], tick)

    @classmethod
    def of_scenario(cls, scenario: Scenario) -> TeamModel:
        """Return the model of a scenario's team."""
        return cls.of(network(scenario), scenario.control, scenario.timing.tick)

    @property
    def robots(self) -> int:
        """Number of robots n."""
        return len(self.rate)

    @cached_property
    def at_rest(self) -> np.ndarray:
        """The fixed point per unit of y, (2n,): every p at 1, every xi at 0.

        xi of equal entries is at rest too; 1'xi never changes (1'L = 0) and starts at 0.
        """
        return np.concatenate([np.ones(self.robots), np.zeros(self.robots)])

    @cached_property
    def moving_part(self) -> np.ndarray:
        """A without the mode that never moves, xi = const 1, which no position feels, (2n, 2n)."""
        return self.step @ zero_sum(self.robots)

    def after(self, ticks: int) -> np.ndarray:
        """Return A^ticks without the mode that never moves, (2n, 2n)."""
        return np.linalg.matrix_power(self.moving_part, ticks) if ticks else zero_sum(self.robots)

    @cached_property
    def growth(self) -> float:
        """Gamma = sup_t ||A^t||_2, what sampling lets the error grow by; 1 in continuous time.

        The largest until some ||A^t|| <= 1, since powers beyond are products of those before. Raises ValueError when
        none is within `MOST_GROWING` ticks: the sampled team is not stable.
        """
        power, largest = self.moving_part, 1.0
        for _ in range(MOST_GROWING):
            norm = float(np.linalg.norm(power, 2))
            if norm <= 1.0:
                return largest
            largest, power = max(largest, norm), power @ self.moving_part
        raise ValueError("the sampled team does not settle")

    def settling_ticks(self, decay: float = DECAY) -> int:
        """Return the least number of ticks T with ||A^T||_2 <= decay on what moves.

        Raises ValueError when the sampled team is not stable, or needs more than `MOST_TICKS`.
        """
        ticks = 1
        while np.linalg.norm(self.after(ticks), 2) > decay:
            ticks *= 2
            if ticks > MOST_TICKS or not np.isfinite(self.after(ticks)).all():
                raise ValueError("the sampled team does not settle")
        low = ticks // 2
        while ticks - low > 1:
            middle = (low + ticks) // 2
            low, ticks = (middle, ticks) if np.linalg.norm(self.after(middle), 2) > decay else (low, middle)
        return ticks

    def predicted(self, p: np.ndarray, xi: np.ndarray, m: np.ndarray, ticks: int) -> tuple[np.ndarray, np.ndarray]:
        """Return p and xi, both (n, 2) [m], a number of ticks later under constant m (2,)."""
        x = np.vstack([p - m, xi])
        for _ in range(ticks):
            x = self.step @ x
        return x[: self.robots] + m, x[self.robots :]
