"""The communication graph and who leads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Network:
    """An undirected, connected graph over n robots, and the leaders.

    Neighbours of robot i are `neighbours[first[i]:first[i + 1]]`, ascending.
    """

    laplacian: np.ndarray  # (n, n) L
    first: np.ndarray  # (n + 1,) int64
    neighbours: np.ndarray  # (2 * edges,) int64
    leader: np.ndarray  # (n,) delta, 1.0 for a leader and 0.0 otherwise

    @property
    def robots(self) -> int:
        """Number of robots n."""
        return len(self.leader)

    @cached_property
    def leaders(self) -> float:
        """Number of leaders."""
        return float(self.leader.sum())

    @cached_property
    def degree(self) -> np.ndarray:
        """Number of neighbours of each robot, (n,)."""
        return np.diff(self.first)

    @cached_property
    def laplacian_pinv(self) -> np.ndarray:
        """Moore-Penrose inverse of the Laplacian, (n, n)."""
        return np.linalg.pinv(self.laplacian)
