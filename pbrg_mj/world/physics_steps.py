"""Seconds as whole physics steps, exactly."""

from __future__ import annotations

import math
import sys
from fractions import Fraction


def steps_until(time: float, physics_step: float) -> int:
    """Return the first physics step at or after `time` [s]."""
    return math.ceil(exact(time) / exact(physics_step))


def steps_during(time: float, duration: float | None, physics_step: float) -> range:
    """Return the physics steps from `time` on, before `time + duration` [s]; None: for good."""
    first, step = exact(time), exact(physics_step)
    end = sys.maxsize if duration is None else math.ceil((first + exact(duration)) / step)
    return range(math.ceil(first / step), end)


def exact(number: float) -> Fraction:
    """Return a number by its shortest decimals: 0.002 s means two milliseconds, not the nearest binary fraction."""
    return Fraction(repr(float(number)))
