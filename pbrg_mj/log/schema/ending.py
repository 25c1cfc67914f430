"""Why a log ends where it does: written behind its last tick, and read again in one line."""

from __future__ import annotations

import signal
from dataclasses import dataclass

from pbrg_mj.errors import PbrgError
from pbrg_mj.scenario.schema import Scenario, whole_number

REASONS = ("finished", "stopped", "interrupted", "error")
MOST_DETAIL = 300  # characters


@dataclass(frozen=True)
class Ending:
    """What a log says about its own end. A run that was killed says nothing: it has none."""

    reason: str  # one of REASONS; stopped: whoever simulated asked for no more ticks
    detail: str  # of an error its text, of an interruption the signal; else empty
    ticks: int  # how many were written

    @classmethod
    def of(cls, error: BaseException | None, ticks: int, scenario: Scenario) -> Ending:
        """Return the end of a run that wrote so many ticks before `error`, if there was one."""
        if error is None:
            return cls("finished" if ticks >= requested_ticks(scenario) else "stopped", "", ticks)
        if isinstance(error, KeyboardInterrupt):
            return cls("interrupted", signal.Signals(getattr(error, "signal", signal.SIGINT)).name, ticks)
        text = str(error) if isinstance(error, PbrgError) else f"{type(error).__name__}: {error}"
        return cls("error", _in_one_line(text), ticks)

    @classmethod
    def read(cls, data: dict[str, str]) -> Ending | None:
        """Return what metadata say; None unless they can be read."""
        ticks, reason = data.get("ticks", ""), data.get("reason")
        if reason not in REASONS or not (ticks.isascii() and ticks.isdigit() and len(ticks) < 20):
            return None
        return cls(reason, _in_one_line(data.get("detail", "")), int(ticks))

    def as_metadata(self) -> dict[str, str]:
        """Return it as metadata."""
        return {"reason": self.reason, "detail": self.detail, "ticks": str(self.ticks)}


def requested_ticks(scenario: Scenario) -> int:
    """Return how many ticks a scenario asks for: from t = 0 to t = duration, both with one."""
    return whole_number(scenario.timing.duration, scenario.timing.tick) + 1


def ending_text(ending: Ending | None, ticks: int, scenario: Scenario) -> str:
    """Return why a log with so many ticks ends, in a few words."""
    if ending is None:  # earlier versions said nothing either
        return "finished" if ticks >= requested_ticks(scenario) else "not said (killed?)"
    detail = {"interrupted": f" ({ending.detail})", "error": f": {ending.detail}"}.get(ending.reason, "")
    lost = f"; {ending.ticks - ticks} more ticks are lost" if ending.ticks > ticks else ""
    return f"{ending.reason}{detail}{lost}"


def _in_one_line(text: str) -> str:
    return " ".join(text.split())[:MOST_DETAIL]
