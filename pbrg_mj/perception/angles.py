"""Angles as compiled code needs them."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def wrapped(angle):
    """Return an angle [rad] in [-pi, pi]."""
    return angle - 2 * math.pi * round(angle / (2 * math.pi))
