"""The communication graph and who leads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


class GraphArrays(NamedTuple):
    """What kernels take of a network, by its names there."""

    first: np.ndarray  # (n + 1,) int64
    neighbours: np.ndarray  # (2 * edges,) int64
    leader: np.ndarray  # (n,)


@dataclass(frozen=True)
class Network:
    """An undirected, connected graph over n robots, and the leaders.

    Neighbours of robot i are `neighbours[first[i]:first[i + 1]]`, ascending. Counted in this order, the directed link e
    brings messages from robot `neighbours[e]` to robot `receiver[e]`.
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

    def times_degree(self, amount: int) -> np.ndarray:
        """Return `amount` times each robot's neighbours, (n,) int64; for the same amount the same read-only array."""
        found = self._times_degree.get(amount)
        if found is None:
            found = self._times_degree[amount] = self.degree * amount
            found.flags.writeable = False
        return found

    @cached_property
    def _times_degree(self) -> dict[int, np.ndarray]:
        return {}

    @cached_property
    def hops(self) -> np.ndarray:
        """Number of links between any two robots, (n, n)."""
        n = self.robots
        reached, linked, hops = np.eye(n, dtype=bool), self.laplacian != 0.0, np.zeros((n, n), dtype=int)
        while not reached.all():
            hops += ~reached
            reached = (reached.astype(float) @ linked) > 0.0
        return hops

    @cached_property
    def diameter(self) -> int:
        """Number of links between the two robots that are the most links apart."""
        return int(self.hops.max())

    @cached_property
    def receiver(self) -> np.ndarray:
        """The robot at the end of each directed link, (2 * edges,)."""
        return np.repeat(np.arange(self.robots), self.degree)

    def links_to(self, i: int) -> range:
        """Return the directed links that bring messages to robot i."""
        return range(self.first[i], self.first[i + 1])

    @cached_property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`GraphArrays` as a plain tuple."""
        return self.first, self.neighbours, self.leader

    @cached_property
    def laplacian_pinv(self) -> np.ndarray:
        """Moore-Penrose inverse of the Laplacian, (n, n)."""
        return np.linalg.pinv(self.laplacian)
