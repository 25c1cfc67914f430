"""The reference governor's problem at one tick, its answer, and what every governor offers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from pbrg_mj.governor.problem.lazy_rows import LazyRows, lazy_rows
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.governor.problem.near_reference import near_references
from pbrg_mj.governor.problem.rows import Rows, row_values
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.network import Network

Status = Literal["ok", "capped", "suspected", "inadmissible", "holding", "infeasible", "diverged", "failed"]
"""What a governor says of its answer.

ok            nothing to report; no promise that the certificate holds: `worst_row` in the log says whether it does
capped        a multiplier is at its cap: the penalty may not be exact any more
suspected     by the states it believes in, some robot has a row that no reference meets: the problem may be infeasible
inadmissible  certified governors: rows forbid the held m, and not every robot's have come that a retreat needs, or
              nothing near the team is admissible
holding       a neighbour is lost: estimates and references are held
infeasible    a solver that knows everything proved that nothing is admissible
diverged      estimates have left all bounds; the last references within them are held
failed        a solver gave up
"""
FORBIDDEN: tuple[Status, ...] = ("inadmissible", "infeasible")
"""Statuses of an m that rows forbid: a certificate says nothing of where a team goes that follows it."""


@lazy_rows("rows")
@dataclass(frozen=True, init=False)
class Problem:
    """min sum_i delta_i ||r_i - m||^2 subject to a rho(m, p, xi) + C m - d <= 0 for all rows (eqs. 10-13).

    r_i is the operator's r as leader i takes it, at most `reference_range` from its p_i. Row i of each array is private
    to robot i. A distributed governor may hand it to robot i's update alone.
    """

    network: Network
    p: np.ndarray  # (n, 2) shifted hand points q_j - b_j as estimated [m]
    xi: np.ndarray  # (n, 2) integral states [m]
    rows: Rows  # (n, R) rows of g_i; given as `LazyRows`, they are made when they are first read
    reference: np.ndarray  # (2,) the operator's r, heard by the leaders only [m]
    half_spaces: HalfSpaces | None = None  # that the rows were made of; row i is private to robot i; None: not kept
    heading: np.ndarray | None = None  # (n,) of the bodies as estimated [rad]; None: not kept
    reference_range: float = math.inf  # [m]
    motion: np.ndarray | None = None  # (n, 1 + d, 2) of `vehicle.motor_lag`, robot by robot [m]; None: not kept

    def __init__(  # at once: field by field, as frozen dataclasses do it, takes five times as long, in every tick
        self,
        network: Network,
        p: np.ndarray,
        xi: np.ndarray,
        rows: Rows,
        reference: np.ndarray,
        half_spaces: HalfSpaces | None = None,
        heading: np.ndarray | None = None,
        reference_range: float = math.inf,
        motion: np.ndarray | None = None,
    ) -> None:
        """Take over the fields; `rows` may be `LazyRows`."""
        vars(self).update(
            network=network,
            p=p,
            xi=xi,
            rows=rows,
            reference=reference,
            half_spaces=half_spaces,
            heading=heading,
            reference_range=reference_range,
            motion=motion,
        )

    @property
    def prediction_state(self) -> tuple[np.ndarray, np.ndarray]:
        """What predictions start from: y (n, 2) and the rest of the state (N - n, 2) [m], without motion p and xi."""
        return prediction_state(self.p, self.xi, self.motion)

    @property
    def rows_given(self) -> Rows | LazyRows:
        """The rows if they have been made, else how they are made."""
        return vars(self)["rows"]

    @property
    def rows_shape(self) -> tuple[int, int]:
        """(n, R), known before rows are made."""
        rows = self.rows_given
        return rows.shape if isinstance(rows, LazyRows) else rows.d.shape

    @cached_property
    def near_references(self) -> np.ndarray:
        """r_i (n, 2) [m], of meaning for leaders only."""
        return near_references(self.p, self.reference, self.reference_range)

    @cached_property
    def mean_reference(self) -> tuple[float, float]:
        """Mean of the leaders' r_i [m]: sum_i delta_i ||r_i - m||^2 has its least value there."""
        x, y = (self.network.leader @ self.near_references / self.network.leaders).tolist()
        return x, y

    @cached_property
    def least_cost(self) -> float:
        """Sum of the leaders' ||r_i - mean reference||^2 [m^2], what no m saves."""
        return float(self.network.leader @ np.sum((self.near_references - self.mean_reference) ** 2, axis=1))

    def cost(self, m: Sequence[float] | np.ndarray) -> float:
        """Return sum_i delta_i ||r_i - m||^2 [m^2]."""
        x, y = self.mean_reference
        return self.network.leaders * ((m[0] - x) * (m[0] - x) + (m[1] - y) * (m[1] - y)) + self.least_cost

    def row_values(self, m: np.ndarray) -> np.ndarray:
        """Return g (n, R) at one m (2,), with p and xi as they are; m is admissible where all are <= 0.

        -inf stands where there is no row.
        """
        return row_values(self.rows, m, self.p, self.xi)


@dataclass(frozen=True, init=False)
class Solution:
    """A governor's answer at one tick."""

    m: np.ndarray  # (n, 2) governed reference as each robot knows it [m]
    multipliers: np.ndarray  # (n, R) lambda, one per row; zeros where the governor has none
    status: Status
    rounds: int  # communication rounds used
    bytes_sent: np.ndarray  # (n,) int64, payload sent by each robot to all its neighbours
    lost: np.ndarray
    """(n,) int64, how many neighbours each robot counts as lost; 0 unless the governor reports otherwise."""

    def __init__(
        self,
        m: np.ndarray,
        multipliers: np.ndarray,
        status: Status,
        rounds: int,
        bytes_sent: np.ndarray,
        lost: np.ndarray | None = None,
    ) -> None:
        """Take over the fields, at once as `Problem` does."""
        if lost is None or len(lost) != len(bytes_sent):
            lost = np.zeros(len(bytes_sent), dtype=np.int64)
        vars(self).update(m=m, multipliers=multipliers, status=status, rounds=rounds, bytes_sent=bytes_sent, lost=lost)

    @classmethod
    def of(cls, problem: Problem, m: np.ndarray, status: Status = "ok") -> Solution:
        """Return the answer of a governor without messages and multipliers; m (n, 2), or (2,) for all robots [m]."""
        n = problem.network.robots
        known = np.array(np.broadcast_to(m, (n, 2)), dtype=float)
        return cls(known, np.zeros(problem.rows_shape), status, 0, np.zeros(n, dtype=np.int64))


class Certificate(Protocol):
    """How half-spaces become constraints; the state enters through rho."""

    def rows(self, half_spaces: HalfSpaces) -> Rows:
        """Return the rows of all robots' private constraints g_i."""
        ...


@runtime_checkable
class StateCertificate(Protocol):
    """How half-spaces and the present state become constraints that are linear in m."""

    def rows_at(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Rows:
        """Return the rows of all robots, two for each slot, with states p, xi (n, 2) [m] while m (2,) [m] is held.

        a is 0 in all.
        """
        ...


class Governor(Protocol):
    """Frozen parameters; all that changes is the memory that goes in and comes out."""

    def init(self, problem: Problem) -> Any:
        """Return the memory before the first tick."""
        ...

    def step(self, problem: Problem, memory: Any) -> tuple[Solution, Any]:
        """Return this tick's answer and the memory for the next tick."""
        ...
