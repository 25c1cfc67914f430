"""Ticks in a row as arrays, ticks first, so that one compiled call evaluates all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel
from pbrg_mj.team.network import Network


@dataclass(frozen=True)
class TickBlock:
    """The problems of T ticks. Rows, which change seldom, stand once for all ticks in a row that share them."""

    problems: Sequence[Problem]
    state: tuple[np.ndarray, np.ndarray, np.ndarray]  # p, xi (T, n, 2) and the operator's r (T, 2) [m]
    rows: tuple[np.ndarray, ...]  # a, C, d, active of U `Rows`, (U, n, R) or (U, n, R, 2)
    rows_at: np.ndarray  # (T,) int64, which of them

    @classmethod
    def of(cls, problems: Sequence[Problem]) -> TickBlock:
        """Return the block of one problem or more, all of one run."""
        distinct: list[Rows] = []
        rows_at = np.empty(len(problems), dtype=np.int64)
        for tick, problem in enumerate(problems):
            if not distinct or problem.rows is not distinct[-1]:
                distinct.append(problem.rows)
            rows_at[tick] = len(distinct) - 1
        return cls(
            problems=problems,
            state=(
                stack_ticks([problem.p for problem in problems]),
                stack_ticks([problem.xi for problem in problems]),
                stack_ticks([problem.reference for problem in problems]),
            ),
            rows=(
                stack_ticks([rows.a for rows in distinct]),
                stack_ticks([rows.C for rows in distinct]),
                stack_ticks([rows.d for rows in distinct]),
                stack_ticks([rows.active for rows in distinct]),
            ),
            rows_at=rows_at,
        )

    @property
    def network(self) -> Network:
        """Who hears whom, the same in a whole run."""
        return self.problems[0].network

    @property
    def arrays(self) -> tuple:
        """What `problem_at` takes."""
        return self.state, self.rows, self.rows_at


@kernel
def problem_at(arrays, t):  # pragma: no cover - compiled
    """Return p, xi and r of a block's tick, and a, C, d and active of its rows."""
    (p, xi, r), (a, C, d, active), rows_at = arrays
    u = rows_at[t]
    return (p[t], xi[t], r[t]), (a[u], C[u], d[u], active[u])


def stack_ticks(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays of one shape as one, (T, ...); a single one is not copied."""
    if len(arrays) == 1:
        return np.ascontiguousarray(arrays[0])[None]
    return np.concatenate(arrays).reshape(len(arrays), *arrays[0].shape)
