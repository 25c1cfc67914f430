"""Clocks of the run, and whole numbers of steps in a period."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from pbrg_mj.scenario.schema.base import Positive, Section

SHORTEST_STEP = 1e-6  # [s] nothing that a robot does is faster
# [s]. Wheels diverge from 2.4 ms on: their inertia in the air over the damping of their bristles (docs/physics.md).
LONGEST_PHYSICS_STEP = 0.002


class Timing(Section):
    """Clocks of the run [s]."""

    duration: Positive = Field(
        default=60.0, description="simulated time of the run [s]; a whole number of ticks, at most 100 million"
    )
    tick: Annotated[float, Field(ge=SHORTEST_STEP, le=10)] = Field(
        default=0.01,
        description="period of governor and control [s]; a whole number of physics steps, at most 10000, "
        "and of all robots together at most 100000",
    )
    physics_step: Annotated[float, Field(ge=SHORTEST_STEP, le=10)] = Field(
        default=0.002, description="step of the rigid-body simulation, at most 2 ms [s]"
    )
    plug_in_limit: Positive = Field(
        default=60.0,
        description="wall-clock time that one call of a plug-in may take, such as a governor's step [s]; a longer one "
        "ends the run with an error",
    )


def whole_multiple(period: float, step: float) -> int | None:
    """Return how many steps make the period, 1 or more; None if that is no whole number to 1e-9 relative.

    Both are > 0, in the same unit.
    """
    ratio = period / step
    if not math.isfinite(ratio):
        return None
    count = round(ratio)
    return count if abs(count * step - period) <= 1e-9 * period else None


def whole_number(period: float, step: float) -> int:
    """Return how many steps make the period. Raises ValueError if it is no whole number, 1 or more."""
    count = whole_multiple(period, step)
    if count is None:
        raise ValueError(f"{period} s is not a whole number of steps of {step} s")
    return count
