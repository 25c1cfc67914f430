"""A run in a few lines: what happened when, and how it ended."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from pbrg_mj.analysis.events import Event, events
from pbrg_mj.analysis.metrics.outcome import Outcome, outcome
from pbrg_mj.log.read.run import Run
from pbrg_mj.text import counted


@dataclass(frozen=True)
class ReplaySummary:
    """What one sees when stepping through a log."""

    scenario: str
    seed: int
    robots: int
    ticks: int
    end: float  # of the last tick [s]
    duration: float  # of the scenario [s]
    ended: str  # why the log ends there
    statuses: dict[str, int]  # governor's status -> ticks
    reference_statuses: dict[str, int]  # centralized optimum's status -> solves
    events: list[Event]
    outcome: Outcome
    damage: str | None

    def lines(self) -> list[str]:
        """Return it as text: a line on the run, one per event, one on how it ended."""
        ended = self.outcome.word + (f" ({self.outcome.reason_text})" if self.outcome.reason else "")
        span = f"{counted(self.ticks, 'tick')}, {self.end:g} of {self.duration:g} s: {self.ended}"
        solves = f"; reference {_counts(self.reference_statuses)}" if self.reference_statuses else ""
        return [
            f"{self.scenario}: {counted(self.robots, 'robot')}, seed {self.seed}; {span}",
            *(f"{event.time:10.3f} s  {event.text}" for event in self.events),
            f"governor {_counts(self.statuses)}{solves}",
            f"outcome {ended}",
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "scenario": self.scenario,
            "seed": self.seed,
            "robots": self.robots,
            "ticks": self.ticks,
            "end_s": self.end,
            "duration_s": self.duration,
            "ended": self.ended,
            "governor_ticks": self.statuses,
            "reference_solves": self.reference_statuses,
            "events": [{"time_s": event.time, "text": event.text, "serious": event.serious} for event in self.events],
            "outcome": self.outcome.word,
            "reason": self.outcome.reason,
            "damage": self.damage,
        }


def replay_summary(run: Run, end: Run | None = None) -> ReplaySummary:
    """Step through a run; `end` are its last seconds, where `run` has not all columns."""
    return ReplaySummary(
        scenario=run.name,
        seed=run.scenario.seed,
        robots=run.scenario.robots,
        ticks=len(run.ticks.time),
        end=float(run.ticks.time[-1]),
        duration=run.scenario.timing.duration,
        ended=run.ending_text,
        statuses=dict(Counter(run.ticks.status.tolist())),
        reference_statuses=dict(Counter(run.optima.status.tolist())),
        events=events(run, end),
        outcome=outcome(run),
        damage=run.damage,
    )


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{status} {count}" for status, count in counts.items())
