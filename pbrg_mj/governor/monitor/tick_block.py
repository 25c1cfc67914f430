"""Ticks in a row as arrays, ticks first, so that one compiled call evaluates all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.problem.block_references import cache_near_references
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel
from pbrg_mj.team.network import Network


@dataclass(frozen=True)
class TickBlock:
    """The problems of T ticks. Rows, which change seldom, stand once for all ticks in a row that share them."""

    problems: Sequence[Problem]
    state: tuple[np.ndarray, np.ndarray, np.ndarray]  # p, xi (T, n, 2) and r_i (T, n, 2) [m]
    rows: Rows  # of U `Rows`, each array with U as its first axis
    rows_at: np.ndarray  # (T,) int64, which of them

    @classmethod
    def of(cls, problems: Sequence[Problem]) -> TickBlock:
        """Return the block of one problem or more, all of one run."""
        distinct: list[Rows] = []
        rows_at = np.empty(len(problems), dtype=np.int64)
        for tick, problem in enumerate(problems):
            rows = problem.rows
            if not distinct or rows is not distinct[-1]:
                distinct.append(rows)
            rows_at[tick] = len(distinct) - 1
        p, xi = stack_ticks([problem.p for problem in problems]), stack_ticks([problem.xi for problem in problems])
        return cls(
            problems=problems,
            state=(p, xi, cache_near_references(problems, p)),
            rows=Rows(*map(stack_ticks, zip(*distinct, strict=True))),
            rows_at=rows_at,
        )

    @property
    def network(self) -> Network:
        """The communication graph, the same in a whole run."""
        return self.problems[0].network

    @cached_property
    def arrays(self) -> tuple:
        """`BlockArrays` as a plain tuple."""
        return (*self.state, *self.rows, self.rows_at)


class BlockArrays(NamedTuple):
    """What kernels take of a block of T ticks with U `Rows`."""

    p: np.ndarray  # (T, n, 2) [m]
    xi: np.ndarray  # (T, n, 2) [m]
    reference: np.ndarray  # (T, n, 2) r_i [m]
    a: np.ndarray  # (U, n, R)
    C: np.ndarray  # (U, n, R, 2)
    d: np.ndarray  # (U, n, R) [m]
    active: np.ndarray  # (U, n, R) bool
    along: np.ndarray  # (U, n, R, 2), or (U, 0, 0, 2)
    rows_at: np.ndarray  # (T,) int64


class TickArrays(NamedTuple):
    """What kernels take of one tick's problem."""

    p: np.ndarray  # (n, 2) [m]
    xi: np.ndarray  # (n, 2) [m]
    reference: np.ndarray  # (n, 2) r_i [m]
    rows: Rows


@kernel
def problem_at(block, t):
    """Return the `TickArrays` of a tick of `BlockArrays`."""
    u = block.rows_at[t]
    rows = Rows(block.a[u], block.C[u], block.d[u], block.active[u], block.along[u])
    return TickArrays(block.p[t], block.xi[t], block.reference[t], rows)


def stack_ticks(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays of one shape as one, (T, ...); a single one is not copied."""
    if len(arrays) == 1:
        return np.ascontiguousarray(arrays[0])[None]
    return np.concatenate(arrays).reshape(len(arrays), *arrays[0].shape)
