"""Half-spaces G q <= h with unit rows, in fixed slots per robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class HalfSpaces:
    """What every robot knows of the obstacles: K slots a robot, each a half-space for HAND POINTS or empty.

    An obstacle keeps its slot as long as it is remembered, so that multipliers carry over from tick to tick.
    """

    G: np.ndarray  # (n, K, 2) unit outward normals in the world; zeros in an empty slot
    h: np.ndarray  # (n, K) [m]; zeros in an empty slot
    active: np.ndarray  # (n, K) bool
    binds: np.ndarray  # (n, K, n) bool: which robots the half-space must hold for; an empty slot binds none
    closing: np.ndarray | None = None  # (n, K) how fast h falls, as far as is known [m/s]; None: nothing moves
    spans: np.ndarray | None = None  # (n, K, 2) where along (-Gy, Gx) hand points are in the way of what comes [m]

    @property
    def closing_speeds(self) -> np.ndarray:
        """`closing` (n, K) [m/s], 0 where nothing moves."""
        return np.zeros(self.h.shape) if self.closing is None else self.closing

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """G, h, active, binds, closing and spans, as kernels take them."""
        return self.G, self.h, self.active, self.binds, self.closing_speeds, self.face_spans

    @property
    def face_spans(self) -> np.ndarray:
        """`spans` (n, K, 2) [m], infinite where an end is not known; 0 where nothing comes."""
        if self.spans is not None:
            return self.spans
        return np.where(self.closing_speeds[..., None] > 0.0, [-np.inf, np.inf], 0.0)

    @classmethod
    def empty(cls, robots: int, slots: int) -> HalfSpaces:
        """Return `robots` x `slots` empty slots."""
        shape = (robots, slots)
        nobody = np.zeros((*shape, robots), dtype=bool)
        return cls(np.zeros((*shape, 2)), np.zeros(shape), np.zeros(shape, dtype=bool), nobody)
