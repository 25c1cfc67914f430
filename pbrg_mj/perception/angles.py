"""Angles as compiled code needs them."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel


@kernel
def wrapped(angle):
    """Return an angle [rad] in [-pi, pi]."""
    return angle - 2 * math.pi * round(angle / (2 * math.pi))
