"""Governors of other packages: what they answer is checked, and copied, so that arrays used again change no record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.monitor.tick_block import TickBlock
from pbrg_mj.governor.problem.interface import Governor, Problem, Solution


@dataclass(frozen=True)
class PlugInGovernor:
    """A governor of another package, which may tell its passivity balances too."""

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

    def passivities(self, block: TickBlock, memories: Sequence[Any], optima: Sequence[Optimum]) -> list[Passivity]:
        """Return what its `passivity(problem, memory, optimum)` says of T ticks, if it has such a method."""
        tell = getattr(self.inner, "passivity", _unknown)
        return [tell(*given) for given in zip(block.problems, memories, optima, strict=True)]

    def flow_passivities(self, block: TickBlock, memories: Sequence[Any]) -> list[Passivity]:
        """Return what its `flow_passivity(problem, memory)` says of T ticks, if it has such a method."""
        tell = getattr(self.inner, "flow_passivity", _unknown)
        return [tell(*given) for given in zip(block.problems, memories, strict=True)]


def _unknown(*_: Any) -> Passivity:
    return Passivity.unknown()


def _copied(name: str, value: Any, shape: tuple[int, ...], kind: type) -> np.ndarray:
    array = np.array(value, kind)
    if array.shape != shape:
        raise ValueError(f"the governor's {name} has shape {array.shape}, not {shape}")
    return array
