"""`operator`: the reference r that the human asks for, over time."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from pydantic import Field

from pbrg_mj.scenario.schema.base import MOST_EVENTS, NonNegative, Section, Vector


class Waypoint(Section):
    """The operator's reference from a time on."""

    time: NonNegative = Field(description="from when on [s]")
    reference: Vector = Field(description="r [m]")


class Operator(Section):
    """The human's reference: constant, or timed waypoints."""

    reference: Vector | None = Field(default=None, description="constant r [m]")
    waypoints: tuple[Waypoint, ...] = Field(
        default=(), description="r over time, each held until the next; the first at 0 s", max_length=MOST_EVENTS
    )


def largest_reference(operator: Operator) -> float:
    """Return the largest size of a component of r [m], of all that come."""
    constant = () if operator.reference is None else (operator.reference,)
    return max(abs(one) for r in (*constant, *(waypoint.reference for waypoint in operator.waypoints)) for one in r)


def operator_reference(operator: Operator, time: float) -> np.ndarray:
    """Return r (2,) [m] at `time` [s]: the constant, or the latest waypoint that has begun."""
    if operator.reference is not None:
        return np.array(operator.reference)
    begun = bisect_right(operator.waypoints, time + 1e-9, key=lambda waypoint: waypoint.time)
    return np.array(operator.waypoints[begun - 1].reference)
