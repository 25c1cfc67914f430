"""Governors of other packages: what they answer is copied, so that one that reuses its arrays changes no record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from pbrg_mj.governor.problem import Governor, Problem, Solution


@dataclass(frozen=True)
class Guest:
    """A governor of another package. What it offers beyond the protocol, such as `passivity`, is its own."""

    inner: Governor

    def init(self, problem: Problem) -> Any:
        """Return the governor's first memory."""
        return self.inner.init(problem)

    def step(self, problem: Problem, memory: Any) -> tuple[Solution, Any]:
        """Return a copy of its answer, and its memory as it is."""
        answer, memory = self.inner.step(problem, memory)
        arrays = {name: getattr(answer, name).copy() for name in ("m", "multipliers", "bytes_sent", "lost")}
        return replace(answer, **arrays), memory

    def __getattr__(self, name: str) -> Any:
        """Return whatever else the governor has."""
        return getattr(self.inner, name)
