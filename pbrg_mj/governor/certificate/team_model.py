"""The pre-stabilised team under a constant governed reference, as the benchmark runs it: eq. 9, sampled.

The two coordinates of the plane decouple. For one of them, x = (p, xi) in R^2n moves from tick to tick by

    x(t + 1) = A x(t) + b y,    A = I + h [[-(L + alpha_r D), L], [-L, -leak L]],    b = h alpha_r (delta, 0)

where y is that coordinate of m. (y 1, 0) is its fixed point, so x - (y 1, 0) moves by A alone. Behind motors and delays
x has more coordinates, N in all, which are 0 at rest, too (`motor_model`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pbrg_mj.governor.certificate.motor_model import motor_maps
from pbrg_mj.scenario.schema import Control, Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import continuous_map, sampled_map, zero_sum
from pbrg_mj.vehicle.motor_lag import MotorLag, motor_lag

DECAY = 1e-3  # of the error's norm, by which a prediction may end
MOST_GROWING = 2000  # ticks in which a stable team's error has begun to fall
MOST_TICKS = 1 << 20  # of a prediction; a team that needs more hardly moves


class UnsettledTeamError(ValueError):
    """The sampled team does not come to rest, or not within the ticks that a certificate foresees."""

    def __init__(self) -> None:
        """Say so."""
        super().__init__(f"the sampled team does not settle within {MOST_TICKS} ticks: no prediction of it ends")


@dataclass(frozen=True, eq=False)
class TeamModel:
    """One coordinate of the team under constant m. Equal models have equal numbers."""

    step: np.ndarray  # (N, N) A; N = 2n but for motors
    rate: np.ndarray  # (n, N) maps the error x - (y 1, 0) to the velocities u that are commanded [1/s]
    tick: float  # h [s]

    @classmethod
    def of(cls, team: Network, control: Control, tick: float, lag: MotorLag | None = None) -> TeamModel:
        """Return the model of a team with the gains of eq. 2, kinematic or with motors, whose lag has the same tick."""
        if lag is not None:
            return cls(*motor_maps(team, control, lag), tick)
        return cls(sampled_map(team, control, tick), continuous_map(team, control)[: team.robots], tick)

    @classmethod
    def of_scenario(cls, scenario: Scenario) -> TeamModel:
        """Return the model of a scenario's team."""
        return cls.of(network(scenario), scenario.control, scenario.timing.tick, motor_lag(scenario))

    @property
    def robots(self) -> int:
        """Number of robots n."""
        return len(self.rate)

    @cached_property
    def at_rest(self) -> np.ndarray:
        """The fixed point per unit of y, (N,): every p at 1, all else at 0. Its norm is sqrt(n).

        xi of equal entries is at rest too; 1'xi never changes (1'L = 0) and starts at 0.
        """
        return np.concatenate([np.ones(self.robots), np.zeros(len(self.step) - self.robots)])

    @property
    def motion_length(self) -> int:
        """Pairs of numbers that a robot's state has besides p and xi: 1 + d behind motors and d ticks, else 0."""
        return len(self.step) // self.robots - 2

    @cached_property
    def position(self) -> np.ndarray:
        """What gives the positions p of the state, (n, N): of motors y - w."""
        n, found = self.robots, np.eye(self.robots, len(self.step))
        if self.motion_length:
            found[:, 2 * n : 3 * n] = -np.eye(n)
        return found

    @cached_property
    def _moves(self) -> np.ndarray:
        """The projector (N, N) onto what moves: xi of sum 0 alone."""
        projector, both = np.eye(len(self.step)), 2 * self.robots
        projector[:both, :both] = zero_sum(self.robots)
        return projector

    @cached_property
    def moving_part(self) -> np.ndarray:
        """A without the mode that never moves, xi = const 1, which no position feels, (N, N)."""
        return self.step @ self._moves

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TeamModel) and self._numbers == other._numbers

    def __hash__(self) -> int:
        return hash(self._numbers)

    @cached_property
    def _numbers(self) -> tuple[bytes, bytes, float]:
        return self.step.tobytes(), self.rate.tobytes(), self.tick

    @cached_property
    def _powers(self) -> list[np.ndarray]:
        """A^(2^k) of the moving part, as many as have been asked for."""
        return [self.moving_part]

    def _power(self, k: int) -> np.ndarray:
        while len(self._powers) <= k:
            self._powers.append(self._powers[-1] @ self._powers[-1])
        return self._powers[k]

    def after(self, ticks: int, rows: np.ndarray | None = None) -> np.ndarray:
        """Return A^ticks without the mode that never moves, (N, N), or `rows` (k, N) of the error times it."""
        moved = self._moves if rows is None else rows @ self._moves
        for k in range(ticks.bit_length()):
            if ticks >> k & 1:
                moved = moved @ self._power(k)
        return moved

    @cached_property
    def growth(self) -> float:
        """Gamma = sup_t ||A^t||_2, what sampling lets the error grow by; 1 in continuous time.

        The largest until some ||A^t|| <= 1, since powers beyond are products of those before. Raises ValueError when
        none is within `MOST_GROWING` ticks: the sampled team is not stable.
        """
        power, largest = self.moving_part, 1.0
        for _ in range(MOST_GROWING):
            norm = _norm(power)
            if norm <= 1.0:
                return largest
            if norm == math.inf:
                break
            largest, power = max(largest, norm), power @ self.moving_part
        raise UnsettledTeamError

    def settling_ticks(self, decay: float = DECAY) -> int:
        """Return the least number of ticks T with ||A^T||_2 <= decay on what moves.

        Raises ValueError when the sampled team is not stable, or needs more than `MOST_TICKS`.
        """
        doublings = 0
        while (norm := _norm(self._power(doublings))) > decay:
            doublings += 1
            if 1 << doublings > MOST_TICKS or norm == math.inf:
                raise UnsettledTeamError
        if doublings == 0:
            return 1
        ticks, power = 1 << doublings - 1, self._power(doublings - 1)  # too few; then the largest number that is
        for k in range(doublings - 2, -1, -1):
            longer = power @ self._power(k)
            if _norm(longer) > decay:
                ticks, power = ticks + (1 << k), longer
        return ticks + 1

    def predicted(self, p: np.ndarray, xi: np.ndarray, m: np.ndarray, ticks: int) -> tuple[np.ndarray, np.ndarray]:
        """Return p (n, 2) and xi (N - n, 2) [m] a number of ticks later under constant m (2,).

        Of motors p is y, and below xi stands the rest of the state: `problem.motion`.
        """
        x = np.vstack([p - m, xi])
        for _ in range(ticks):
            x = self.step @ x
        return x[: self.robots] + m, x[self.robots :]


def _norm(matrix: np.ndarray) -> float:
    """Return the largest singular value, inf when its square overflows; the others would take three times as long."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = matrix.T @ matrix
    return math.sqrt(np.linalg.eigvalsh(square)[-1]) if np.isfinite(square).all() else math.inf
