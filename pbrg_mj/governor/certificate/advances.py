"""What a certificate says of each half-space: an interval of the advance of m along its normal, as two rows."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces


class Advances(NamedTuple):
    """How far m may move along the normal of each half-space from where it is held.

    No advance is allowed where low > high.
    """

    low: np.ndarray  # (n, K) [m]; -inf where nothing is asked
    high: np.ndarray  # (n, K) [m]; inf likewise

    @classmethod
    def empty(cls, shape: tuple[int, ...]) -> Advances:
        """Return advances that are still to be written."""
        return cls(*np.empty((2, *shape)))


@runtime_checkable
class AdvanceCertificate(Protocol):
    """A certificate that says of each half-space how far m may move along its normal."""

    def advances(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Advances:
        """Return the advances with the states p, xi (n, 2) [m] while m (2,) [m] is held."""
        ...


def interval_rows(half_spaces: HalfSpaces, held: np.ndarray, allowed: Advances) -> Rows:
    """Return the advances from the held m (2,) as rows G.m <= G.held + high and -G.m <= -(G.held + low).

    Of robot i, row 2k and 2k + 1 belong to slot k.
    """
    n, slots = half_spaces.h.shape
    C, d = np.empty((n, slots, 2, 2)), np.empty((n, slots, 2))
    at = half_spaces.G[:, :, 0] * held[0] + half_spaces.G[:, :, 1] * held[1]  # in this order on every processor
    C[:, :, 0], C[:, :, 1] = half_spaces.G, -half_spaces.G
    d[:, :, 0], d[:, :, 1] = at + allowed.high, -(at + allowed.low)
    active = half_spaces.active[:, :, None] & np.isfinite(d)
    d = np.where(active, d, 0.0).reshape(n, 2 * slots)
    return Rows(np.zeros(d.shape), C.reshape(n, 2 * slots, 2), d, active.reshape(d.shape))
