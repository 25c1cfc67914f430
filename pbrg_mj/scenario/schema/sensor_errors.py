"""Types of the sensors' errors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Deviation = Annotated[float, Field(ge=0, le=1000)]
"""Of noise: a sensor that errs by more than a kilometre, or three turns, says nothing."""

Bias = Annotated[float, Field(ge=-1000, le=1000)]
PerRobot = Bias | tuple[Bias, ...]
"""One for all robots, or one per robot."""


def per_robot(given: PerRobot, robots: int) -> tuple[float, ...]:
    """Return one number for each robot."""
    return given if isinstance(given, tuple) else (given,) * robots
