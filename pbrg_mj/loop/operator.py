"""What the operator asks for at a time."""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.schema import Operator


def operator_reference(operator: Operator, time: float) -> np.ndarray:
    """Return r (2,) [m] at `time` [s]: the constant, or the latest waypoint that has begun."""
    if operator.reference is not None:
        return np.array(operator.reference)
    begun = [waypoint for waypoint in operator.waypoints if waypoint.time <= time + 1e-9]
    return np.array(begun[-1].reference)
