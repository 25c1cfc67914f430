"""Governors, certificates and solvers of other packages: they get inputs that they cannot change, and limited time.

Their answers are checked and copied. So an array that is used again changes no record, and an error says whose it is.
"""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.centralized.optimum import CentralizedSolver, Optimum, OptimumStatus
from pbrg_mj.governor.problem.interface import Certificate, Governor, Problem, Solution, Status
from pbrg_mj.governor.problem.rows import ALL_MOTION, Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.plugin_calls import ReadOnlyCopies, chosen, copied, plug_in_errors, read_only_copy, where_active, within

FARTHEST = 1e9  # [m] of a reference, and of what stands in rows
LARGEST_MULTIPLIER = 1e12  # [m]
ROUNDING = 1e-9  # of a unit vector's length
LONGEST_STATUS = 200  # characters of a solver's own words


@dataclass(frozen=True)
class PlugInGovernor:
    """A governor of another package."""

    inner: Governor
    name: str = "object"
    limit: float | None = None  # of a call [s]
    read_only_copies: ReadOnlyCopies = field(default_factory=ReadOnlyCopies, repr=False, compare=False)

    def init(self, problem: Problem) -> Any:
        """Return the governor's first memory. Raises PlugInError when it fails."""
        with plug_in_errors("governor", self.name, "init", self.limit):
            return self.inner.init(self.read_only_problem(problem))

    def step(self, problem: Problem, memory: Any) -> tuple[Solution, Any]:
        """Return a copy of its answer, and its memory as it is.

        It sees the whole team and sends no messages: rounds and bytes that it reports are set to 0.

        Raises PlugInError when it fails or takes too long, and for an answer that `checked_solution` refuses.
        """
        given = self.read_only_problem(problem)
        with plug_in_errors("governor", self.name, "step", self.limit):
            answer = self.inner.step(given, memory)
        solution, memory = self.checked(problem, answer)
        return replace(solution, rounds=0, bytes_sent=np.zeros_like(solution.bytes_sent)), memory

    def checked(self, problem: Problem, answer: Any) -> tuple[Solution, Any]:
        """Return what a step answered, checked."""
        whose = f"{self.name}: the governor"
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise PlugInError(f"{whose}'s step returned {type(answer).__name__}, not solution and memory")
        with plug_in_errors("governor", self.name, "its answer"):
            return checked_solution(whose, problem, answer[0]), answer[1]

    def read_only_problem(self, problem: Problem) -> Problem:
        """Return a copy of the problem that cannot be written into."""
        given = {name: read_only_copy(getattr(problem, name)) for name in ("p", "xi", "reference", "heading")}
        team, rows = self.read_only_copies("network", problem.network), self.read_only_copies("rows", problem.rows)
        half_spaces = self.read_only_copies("half_spaces", problem.half_spaces)
        return replace(problem, network=team, rows=rows, half_spaces=half_spaces, **given)


def checked_solution(whose: str, problem: Problem, answer: Any) -> Solution:
    """Return a copy of a governor's answer with arrays of the protocol's types. Raises PlugInError."""
    n, rows = problem.rows.d.shape
    if not isinstance(answer, Solution):
        raise PlugInError(f"{whose}'s step returned {type(answer).__name__} and memory, not Solution and memory")
    solution = Solution(
        m=copied(whose, "m", answer.m, (n, 2)),
        multipliers=copied(whose, "multipliers", answer.multipliers, (n, rows)),
        status=chosen(whose, "status", answer.status, get_args(Status)),
        rounds=int(copied(whose, "rounds", answer.rounds, (), np.int64)),
        bytes_sent=copied(whose, "bytes_sent", answer.bytes_sent, (n,), np.int64),
        lost=copied(whose, "lost", answer.lost, (n,), np.int64),
    )
    if not np.isfinite(solution.m).all():
        raise PlugInError(f"{whose}'s m is not finite; hold the last reference and say so by the status")
    within(whose, "m", solution.m, FARTHEST)
    within(whose, "multipliers", solution.multipliers, LARGEST_MULTIPLIER, least=0.0)
    if np.any(solution.lost > problem.network.degree):
        raise PlugInError(f"{whose}'s lost is more than a robot has neighbours")
    return solution


@dataclass(frozen=True)
class PlugInCertificate:
    """A certificate of another package."""

    inner: Certificate
    name: str = "object"
    limit: float | None = None  # of a call [s]
    widths: list[int] = field(default_factory=list, repr=False, compare=False)  # R of its first rows

    def rows(self, half_spaces: HalfSpaces) -> Rows:
        """Return a copy of its rows.

        Raises PlugInError when it fails, for other shapes than those of its first rows, for numbers that are not finite
        for negative weights a, and for directions that are not unit vectors.
        """
        whose, given = f"{self.name}: the certificate", read_only_copy(half_spaces)
        with plug_in_errors("certificate", self.name, "rows", self.limit):
            rows = self.inner.rows(given)
        if not isinstance(rows, Rows):
            raise PlugInError(f"{whose}'s rows are {type(rows).__name__}, not Rows")
        with plug_in_errors("certificate", self.name, "its answer"):
            width = np.shape(rows.d)[-1] if np.ndim(rows.d) else 0
        self.widths[:] = self.widths or [width]
        shape = (len(half_spaces.h), self.widths[0])
        active = copied(whose, "active", rows.active, shape, bool)
        a, C, d = (
            where_active(active, copied(whose, what, value, of))
            for what, value, of in (("a", rows.a, shape), ("C", rows.C, (*shape, 2)), ("d", rows.d, shape))
        )
        if not all(np.isfinite(array).all() for array in (a, C, d)):
            raise PlugInError(f"{whose}'s active rows hold a number that is not finite")
        if np.any(a[active] < 0):
            raise PlugInError(f"{whose}'s a has a negative weight; allowed: 0 and more, for else g is not convex")
        for what, array in (("a", a), ("C", C), ("d", d)):
            within(whose, what, array[active], FARTHEST)
        return Rows(a, C, d, active, _directions(whose, rows.along, active))


def _directions(whose: str, given: Any, active: np.ndarray) -> np.ndarray:
    """Return a copy of rows' directions, none or one for each row. Raises PlugInError for others."""
    if np.size(given) == 0:
        return ALL_MOTION
    along = where_active(active, copied(whose, "along", given, (*active.shape, 2)))
    if not np.all(np.abs(np.linalg.norm(along[active], axis=-1) - 1.0) <= ROUNDING):
        raise PlugInError(f"{whose}'s along has a vector that is not of length 1")
    return along


@dataclass(frozen=True)
class PlugInSolver:
    """A solver of the centralized reference of another package."""

    inner: CentralizedSolver
    name: str = "object"
    limit: float | None = None  # of a call [s]

    def solve(self, problem: Problem) -> Optimum:
        """Return a copy of its optimum. Raises PlugInError when it fails, for other shapes and an unknown status."""
        whose, given = f"{self.name}: the reference solver", read_only_copy(problem)
        with plug_in_errors("reference solver", self.name, "solve", self.limit):
            found = self.inner.solve(given)
        if not isinstance(found, Optimum):
            raise PlugInError(f"{whose}'s solve returned {type(found).__name__}, not Optimum")
        status = chosen(whose, "status", found.status, get_args(OptimumStatus))
        if not isinstance(found.solver_status, str):
            raise PlugInError(f"{whose}'s solver_status is {type(found.solver_status).__name__}; allowed: text")
        m = copied(whose, "m", found.m, (2,))
        multipliers = copied(whose, "multipliers", found.multipliers, problem.rows.d.shape)
        seconds = [_seconds(whose, name, getattr(found, name)) for name in ("build_seconds", "solve_seconds")]
        cost = float(copied(whose, "cost", found.cost, ()))
        if status == "solved":
            if not (np.isfinite(m).all() and np.isfinite(multipliers).all()):
                raise PlugInError(f"{whose}'s m or multipliers are not finite, though the status is solved")
            within(whose, "m", m, FARTHEST)
            within(whose, "cost", np.array(cost), FARTHEST**2)
        return Optimum(m, status, cost, multipliers, str(found.solver_status)[:LONGEST_STATUS], *seconds)


def _seconds(whose: str, name: str, value: Any) -> float:
    if not (isinstance(value, numbers.Real) and math.isfinite(value) and float(value) >= 0):
        raise PlugInError(f"{whose}'s {name} is {value!r}; allowed: a number from 0 on")
    return float(value)
