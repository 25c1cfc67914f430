"""Governors of other packages: what they answer is checked, and copied, so that arrays used again change no record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pbrg_mj.governor.problem.interface import Governor, Problem, Solution


@dataclass(frozen=True)
class PlugInGovernor:
    """A governor of another package, whose answers are checked and copied."""

    inner: Governor

    def init(self, problem: Problem) -> Any:
        """Return the governor's first memory."""
        return self.inner.init(problem)

    def step(self, problem: Problem, memory: Any) -> tuple[Solution, Any]:
        """Return a copy of its answer, and its memory as it is. Raises ValueError for an array of another shape."""
        answer, memory = self.inner.step(problem, memory)
        n, rows = problem.rows.d.shape
        arrays = {
            "m": _copied("m", answer.m, (n, 2), float),
            "multipliers": _copied("multipliers", answer.multipliers, (n, rows), float),
            "bytes_sent": _copied("bytes_sent", answer.bytes_sent, (n,), np.int64),
            "lost": _copied("lost", answer.lost, (n,), np.int64),
        }
        return replace(answer, **arrays), memory


def _copied(name: str, value: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    array = np.array(value, kind)
    if array.shape != shape:
        raise ValueError(f"the governor's {name} has shape {array.shape}, not {shape}")
    return array
