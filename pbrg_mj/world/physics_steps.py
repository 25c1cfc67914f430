"""Seconds as whole physics steps, exactly."""

from __future__ import annotations

import math
import sys
from fractions import Fraction

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.schema import LONGEST_PHYSICS_STEP, Timing, whole_number


def steps_per_tick(timing: Timing) -> int:
    """Return how many physics steps make a tick.

    Raises InputError for a step at which wheels diverge, which logs of earlier models may hold; ValueError when steps
    do not fit the tick.
    """
    if timing.physics_step > LONGEST_PHYSICS_STEP:
        message = f"is {timing.physics_step} s; allowed: at most {LONGEST_PHYSICS_STEP} s"
        raise InputError(message, key="timing.physics_step")
    return whole_number(timing.tick, timing.physics_step)


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
