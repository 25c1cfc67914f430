"""What happened when, in words: the governor's status, contacts, wind-up, the reference, and how it ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.binding import bindings
from pbrg_mj.analysis.metrics.contacts import FIELDS, contact_flags, contact_text, is_violation, onsets
from pbrg_mj.analysis.metrics.outcome import outcome
from pbrg_mj.log.read.run import Run
from pbrg_mj.team.graph import network
from pbrg_mj.team.wind_up import slowest_rate
from pbrg_mj.text import format_significant

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


def events(run: Run, end: Run | None = None) -> list[Event]:
    """Return the run's events in order; of very many only the first ones, and how many there are.

    `end` are its last seconds, where `run` has not all columns.
    """
    found = sorted([*_statuses(run), *_touches(run), *_wind_ups(run), *_references(run)], key=lambda event: event.time)
    if len(found) > MOST_EVENTS:
        rest = len(found) - MOST_EVENTS
        found = [*found[:MOST_EVENTS], Event(found[MOST_EVENTS].time, f"and {rest} more from here on", False)]
    return [*found, *_end(run, end or run)]


def _end(run: Run, end: Run) -> Iterator[Event]:
    """Yield how the run ended, and what binds then."""
    ended, time = outcome(run), _time(run, -1)
    yield Event(
        time,
        f"{ended.word}: {ended.reason_text}" if ended.reason else ended.word,
        ended.word in ("violated", "diverged"),
    )
    for one in bindings(end):
        yield Event(time, f"binds: {one.text}", False)


def _statuses(run: Run) -> list[Event]:
    status = run.ticks.status.astype(str)
    changed = np.flatnonzero(np.append(status[0] != "ok", status[1:] != status[:-1]))
    return [Event(_time(run, k), f"governor: {status[k]}", status[k] != "ok") for k in changed.tolist()]


def _touches(run: Run) -> Iterator[Event]:
    for kind in FIELDS:
        for k, j in onsets(contact_flags(run, kind)):
            text = f"robot {j + 1} touches {contact_text(run, kind, k, j)}"
            yield Event(_time(run, k), text, is_violation(run, kind))


def _wind_ups(run: Run) -> Iterator[Event]:
    """Yield wind-ups that last: what the detector's memory, 1 / lambda_2, does not bridge is an episode of its own."""
    rate = slowest_rate(network(run.scenario))
    scale = 1 / rate if rate > 0 else 0.0
    for robot in range(run.ticks.winding_up.shape[1]):
        for first, last in episodes(run.ticks.winding_up[:, robot], run.ticks.time, scale):
            lasted = run.ticks.time[last] - run.ticks.time[first]
            yield Event(
                _time(run, first), f"robot {robot + 1}: integrator wind-up for {format_significant(lasted, 2)} s", False
            )


def episodes(flag: np.ndarray, time: np.ndarray, scale: float) -> list[tuple[int, int]]:
    """Return first and last tick of every time during which a flag (T,) was up, of a length of `scale` [s] or more.

    Pauses shorter than `scale` do not end one.
    """
    up = np.flatnonzero(flag)
    if not len(up):
        return []
    breaks = np.flatnonzero(time[up[1:]] - time[up[:-1] + 1] >= scale) + 1
    spans = [(int(part[0]), int(part[-1])) for part in np.split(up, breaks)]
    return [(first, last) for first, last in spans if time[last] - time[first] >= scale]


def _references(run: Run) -> list[Event]:
    r = run.ticks.reference
    changed = np.flatnonzero((np.diff(r, axis=0) != 0).any(axis=1)) + 1
    return [Event(_time(run, k), f"new reference {_point(r[k])} m", False) for k in changed.tolist()]


def _point(place: np.ndarray) -> str:
    return f"({', '.join(format_significant(float(one), 3) for one in place)})"


def _time(run: Run, row: int) -> float:
    return float(run.ticks.time[row])
