"""What happened when, in words: the governor's status, touches of walls, wind-up, changes of the reference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.contacts import FIELDS, contact_flags, is_violation, onsets, words
from pbrg_mj.log.read.run import Run

MOST_EVENTS = 60


@dataclass(frozen=True)
class Event:
    """A moment worth looking at."""

    time: float  # [s]
    text: str
    serious: bool

    def as_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"time": self.time, "text": self.text, "serious": self.serious}


def events(run: Run) -> list[Event]:
    """Return the run's events in order; of very many only the first ones, and how many there are."""
    found = sorted([*_statuses(run), *_touches(run), *_wind_ups(run), *_references(run)], key=lambda event: event.time)
    if len(found) <= MOST_EVENTS:
        return found
    rest = len(found) - MOST_EVENTS
    return [*found[:MOST_EVENTS], Event(found[MOST_EVENTS].time, f"and {rest} more from here on", False)]


def _statuses(run: Run) -> list[Event]:
    status = run.ticks.status.astype(str)
    changed = np.flatnonzero(np.append(status[0] != "ok", status[1:] != status[:-1]))
    return [Event(_time(run, k), f"governor: {status[k]}", status[k] != "ok") for k in changed.tolist()]


def _touches(run: Run) -> Iterator[Event]:
    for kind in FIELDS:
        for k, j in onsets(contact_flags(run, kind)):
            text = f"robot {j + 1} touches {words(run, kind, k, j)}"
            yield Event(_time(run, k), text, is_violation(run, kind))


def _wind_ups(run: Run) -> list[Event]:
    return [Event(_time(run, k), f"robot {j + 1}: integrator wind-up", False) for k, j in onsets(run.ticks.winding_up)]


def _references(run: Run) -> list[Event]:
    r = run.ticks.reference
    changed = np.flatnonzero((np.diff(r, axis=0) != 0).any(axis=1)) + 1
    return [Event(_time(run, k), f"new reference ({r[k, 0]:.3g}, {r[k, 1]:.3g}) m", False) for k in changed.tolist()]


def _time(run: Run, row: int) -> float:
    return float(run.ticks.time[row])
