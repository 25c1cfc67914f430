"""How near a run came to a failure, from its record: below 0 it is one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Literal

from pbrg_mj.analysis.metrics.outcome import ROUNDING
from pbrg_mj.studies.run_task import Record

Kind = Literal["contact", "crossing", "certificate", "stall"]
CONTACTS = ("wall_contacts", "moving_contacts", "robot_contacts")
STALLED = ("stuck", "stalled", "circling", "receding")
OWN = {
    "ball": "certificate_worst_m",
    "directional_ball": "directional_ball_worst_m",
    "predictive": "predictive_worst_m",
}
VIOLATED = 1e-6  # [m] as the share of ticks counts
FARTHEST = 1e3  # [m] where nothing is near
CLEARANCE = 0.1  # [m] of a hand point's margin: the body is within


def contact(record: Record) -> float:
    """Return the least distance to anything, -1 with a contact [m]: a contact is what the simulation counts as one."""
    if any(record[name] for name in CONTACTS):
        return -1.0
    gaps = [_number(record, "robot_gap_min_m"), _number(record, "true_margin_min_m") + CLEARANCE]
    return max(0.0, min(gaps))


def crossing(record: Record) -> float:
    """Return the least margin of a hand point to an obstacle's line, and rounding, as the outcome has it [m]."""
    return _number(record, "true_margin_min_m") + ROUNDING


def certificate(record: Record) -> float:
    """Return the slack of the certificate that the governor asks for, or of the ball if it asks for none [m]."""
    worst = record.get(OWN.get(record["own_certificate"] or "ball", "certificate_worst_m"))
    return VIOLATED - worst if worst is not None else FARTHEST


def stall(record: Record) -> float:
    """Return minus the distance left of a team that came to rest or turns back, else 1 less its part [m]."""
    left = record["terminal_gap_m"]
    left = 0.0 if left is None else left
    return -left if record["outcome"] in STALLED else 1.0 / (1.0 + left)


FAILURES: Mapping[Kind, Callable[[Record], float]] = {
    "contact": contact,
    "crossing": crossing,
    "certificate": certificate,
    "stall": stall,
}


def _number(record: Record, name: str) -> float:
    value = record[name]
    return FARTHEST if value is None or not math.isfinite(value) else float(value)
