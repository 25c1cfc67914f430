"""What all sections share."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

# What lies beyond these is a slip of the keyboard, and overflows somewhere: squares of squares must be doubles, counts
# of ticks and rounds 64-bit integers. A nanosecond, a nanometre and their inverses are within.
LARGEST = 1e9
SMALLEST = 1e-9  # of what must not be 0; smaller numbers may have an infinite inverse
FARTHEST = 1e6  # coordinate [m]: a double tells points 1e-10 m apart there, and perception squares no more
MOST_ROBOTS = 500  # each keeps 4n + 2 numbers twice and 4n rows: together 50 MB a tick, several ticks at once
MOST_OBSTACLES = 500  # of each kind; every robot's margin to every one is taken in every tick
MOST_EVENTS = 10_000  # of each kind, in one run

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Vector = tuple[Coordinate, Coordinate]
Positive = Annotated[float, Field(ge=SMALLEST, le=LARGEST)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Probability = Annotated[float, Field(ge=0, le=1)]
RobotNumber = Annotated[int, Field(ge=1)]
Deviation = Annotated[float, Field(ge=0, le=1000)]
"""Of noise: a sensor with errors of a kilometre, or of three turns, measures nothing."""
Bias = Annotated[float, Field(ge=-1000, le=1000)]
PerRobot = Bias | tuple[Bias, ...]
"""One for all robots, or one per robot."""


class Section(BaseModel):
    """Base of all sections: frozen, no unknown keys, no NaN, no silent conversion of strings to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, allow_inf_nan=False, populate_by_name=True)


def per_robot(given: PerRobot, robots: int) -> tuple[float, ...]:
    """Return one number for each robot."""
    return given if isinstance(given, tuple) else (given,) * robots
