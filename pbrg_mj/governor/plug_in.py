"""Governors, certificates and solvers of other packages: their answers are checked, and copied.

So an array that is used again changes no record, and an error says whose it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.centralized.optimum import CentralizedSolver, Optimum, OptimumStatus
from pbrg_mj.governor.problem.interface import Certificate, Governor, Problem, Solution, Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.plugins import blaming, copied


@dataclass(frozen=True)
class PlugInGovernor:
    """A governor of another package."""

    inner: Governor
    name: str = "object"

    def init(self, problem: Problem) -> Any:
        """Return the governor's first memory. Raises PlugInError when it fails."""
        with blaming("governor", self.name, "init"):
            return self.inner.init(problem)

    def step(self, problem: Problem, memory: Any) -> tuple[Solution, Any]:
        """Return a copy of its answer, and its memory as it is.

        Raises PlugInError when it fails, for an array of another shape, for an unknown status and for negative counts.
        """
        with blaming("governor", self.name, "step"):
            answer, memory = self.inner.step(problem, memory)
        return checked_solution(f"{self.name}: the governor", problem, answer), memory


def checked_solution(whose: str, problem: Problem, answer: Solution) -> Solution:
    """Return a copy of a governor's answer with arrays of the protocol's types. Raises PlugInError."""
    n, rows = problem.rows.d.shape
    if not isinstance(answer, Solution):
        raise PlugInError(f"{whose}'s step returned {type(answer).__name__} and memory, not Solution and memory")
    if answer.status not in get_args(Status):
        raise PlugInError(f"{whose}'s status is {answer.status!r}; allowed: {', '.join(get_args(Status))}")
    solution = Solution(
        m=copied(whose, "m", answer.m, (n, 2)),
        multipliers=copied(whose, "multipliers", answer.multipliers, (n, rows)),
        status=answer.status,
        rounds=answer.rounds,
        bytes_sent=copied(whose, "bytes_sent", answer.bytes_sent, (n,), np.int64),
        lost=copied(whose, "lost", answer.lost, (n,), np.int64),
    )
    counts = {"rounds": np.asarray(answer.rounds), "bytes_sent": solution.bytes_sent, "lost": solution.lost}
    for name, count in counts.items():
        if not np.issubdtype(count.dtype, np.integer) or np.any(count < 0):
            raise PlugInError(f"{whose}'s {name} is {count.tolist()}; allowed: whole numbers from 0 on")
    return solution


@dataclass(frozen=True)
class PlugInCertificate:
    """A certificate of another package."""

    inner: Certificate
    name: str = "object"

    def rows(self, half_spaces: HalfSpaces) -> Rows:
        """Return a copy of its rows. Raises PlugInError when it fails, for other shapes and for negative weights a."""
        whose = f"{self.name}: the certificate"
        with blaming("certificate", self.name, "rows"):
            rows = self.inner.rows(half_spaces)
        if not isinstance(rows, Rows):
            raise PlugInError(f"{whose}'s rows are {type(rows).__name__}, not Rows")
        shape = (len(half_spaces.h), np.shape(rows.d)[-1] if np.ndim(rows.d) else 0)
        checked = Rows(
            a=copied(whose, "a", rows.a, shape),
            C=copied(whose, "C", rows.C, (*shape, 2)),
            d=copied(whose, "d", rows.d, shape),
            active=copied(whose, "active", rows.active, shape, bool),
        )
        if not all(np.isfinite(array[checked.active]).all() for array in checked[:3]):
            raise PlugInError(f"{whose}'s active rows hold a number that is not finite")
        if np.any(checked.a[checked.active] < 0):
            raise PlugInError(f"{whose}'s a has a negative weight; allowed: 0 and more, for else g is not convex")
        return checked


@dataclass(frozen=True)
class PlugInSolver:
    """A solver of the centralized reference of another package."""

    inner: CentralizedSolver
    name: str = "object"

    def solve(self, problem: Problem) -> Optimum:
        """Return a copy of its optimum. Raises PlugInError when it fails, for other shapes and an unknown status."""
        whose = f"{self.name}: the reference solver"
        with blaming("reference solver", self.name, "solve"):
            found = self.inner.solve(problem)
        if not isinstance(found, Optimum):
            raise PlugInError(f"{whose}'s solve returned {type(found).__name__}, not Optimum")
        if found.status not in get_args(OptimumStatus):
            raise PlugInError(f"{whose}'s status is {found.status!r}; allowed: {', '.join(get_args(OptimumStatus))}")
        m = copied(whose, "m", found.m, (2,))
        multipliers = copied(whose, "multipliers", found.multipliers, problem.rows.d.shape)
        if found.status == "solved" and not (np.isfinite(m).all() and np.isfinite(multipliers).all()):
            raise PlugInError(f"{whose}'s m or multipliers are not finite, though the status is solved")
        return found._replace(m=m, multipliers=multipliers)
