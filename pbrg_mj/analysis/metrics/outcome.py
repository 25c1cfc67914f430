"""How a run ended, in one word. docs/outcomes.md states the rules with their time scales."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from pbrg_mj.analysis.metrics.best_formation import BestFormation, best_formation
from pbrg_mj.analysis.metrics.contacts import FIELDS, Kind, contact_flags, contact_text, is_violation
from pbrg_mj.analysis.metrics.margins import obstructed, static_margin
from pbrg_mj.analysis.metrics.per_tick import per_tick, state_size
from pbrg_mj.analysis.metrics.settling import CLOCK_ROUNDING, formation_errors
from pbrg_mj.analysis.metrics.trend import Direction, Trend, extent_of, trend
from pbrg_mj.log.read.run import Run
from pbrg_mj.text import format_significant

Violation = Kind | Literal["half-space"]
Word = Literal[
    "violated", "diverged", "converged", "closing in", "receding", "circling", "stuck", "stalled", "unfinished"
]
WORDS: dict[Direction, Word] = {
    "closing in": "closing in",
    "receding": "receding",
    "circling": "circling",
    "standing": "stuck",
    "wandering": "stalled",
}
ROUNDING = 1e-6  # [m] a margin above -ROUNDING is on the line, not past it
HUNTING = 1e-3  # [m] a team at rest that moves farther than this from its mean place hunts


@dataclass(frozen=True)
class Outcome:
    """The word, and what led to it where it needs saying; robot, time and kind of the first violation.

    `trend` is that of the last seconds; None for a run that was violated, diverged or is too short.
    """

    word: Word
    reason: str | None = None
    robot: int | None = None  # counted from 1
    time: float | None = None  # [s]
    kind: Violation | None = None  # with what
    trend: Trend | None = None

    @property
    def reason_text(self) -> str | None:
        """The reason as people read it; of a violation with robot and time."""
        return reason_text(self.reason, self.robot, self.time)


def reason_text(reason: str | None, robot: int | None, time: float | None) -> str | None:
    """Return a reason with the robot and the time [s] of a violation: at 4.82 s robot 1 passed a wall's line."""
    if reason is None or robot is None or time is None:
        return reason
    return f"at {format_significant(time, 4)} s robot {robot} {reason}"


def outcome(run: Run) -> Outcome:
    """Return the outcome by ground truth: violated before diverged, before converged, before what the trend says."""
    return _violated(run) or _diverged(run) or _ended(run)


def formation_error(run: Run, point: ArrayLike) -> np.ndarray:
    """Return max_j ||q_j - b_j - point|| (T,) [m] with true hand points."""
    return formation_errors(run.ticks.hand_true, run.scenario, np.asarray(point))


def final_target(run: Run) -> BestFormation:
    """Return the best admissible formation for the last r."""
    return best_formation(run.scenario, run.ticks.reference[-1])


def first_violation_rows(run: Run) -> Iterator[tuple[str, int]]:
    """Yield the rows at which there is a first sign of a violation or of divergence, each with a name of its kind.

    Of a run that is known in parts, `outcome` needs these of every part, where r changed last, and its last seconds.
    """
    for k, (_, flags, _) in enumerate(_violations(run)):
        yield from ((f"violation {k}", row) for row in np.flatnonzero(flags.any(axis=1))[:1].tolist())
    size, limit = per_tick(run, state_size), run.scenario.divergence_limit
    for name, flag in (
        ("status", run.ticks.status == "diverged"),
        ("finite", ~np.isfinite(size)),
        ("beyond", size > limit),
    ):
        yield from ((name, row) for row in np.flatnonzero(flag)[:1].tolist())


def _violated(run: Run) -> Outcome | None:
    found = [
        Outcome("violated", reason(tick, robot), robot + 1, float(run.ticks.time[tick]), kind)
        for kind, flags, reason in _violations(run)
        for tick, robot in np.argwhere(flags)[:1].tolist()
    ]
    return min(found, key=lambda violation: violation.time or 0.0, default=None)


def _violations(run: Run) -> Iterator[tuple[Violation, np.ndarray, Callable[[int, int], str]]]:
    """Yield kind, flags (T, n) and words of everything that counts as a violation; contacts before lines."""
    for kind in FIELDS:
        if is_violation(run, kind):
            yield kind, contact_flags(run, kind), partial(_touched, run, kind)
    behind = static_margin(run.ticks, run.scenario) < -ROUNDING
    if not obstructed(run.scenario):
        yield "half-space", behind, lambda _tick, _robot: "passed a given half-space"
    elif is_violation(run, "walls"):
        yield "walls", behind, lambda _tick, _robot: "passed a wall's line"
    if is_violation(run, "moving"):
        yield "moving", run.ticks.moving_margin < -ROUNDING, lambda _tick, _robot: "passed a moving box's line"


def _touched(run: Run, kind: Kind, tick: int, robot: int) -> str:
    return f"touched {contact_text(run, kind, tick, robot)}"


def _diverged(run: Run) -> Outcome | None:
    limit = run.scenario.divergence_limit
    if np.any(run.ticks.status == "diverged"):
        return Outcome("diverged", "the governor's estimates")
    size = per_tick(run, state_size)
    if not np.isfinite(size).all():
        return Outcome("diverged", "not finite")
    if np.any(size > limit):
        return Outcome("diverged", f"beyond {format_significant(limit, 6)} m")
    return None


def _ended(run: Run) -> Outcome:
    rules, time, best = run.scenario.outcome, run.ticks.time, final_target(run)
    recent = _last(time, rules.rest_time)
    if recent is None:
        return Outcome("unfinished", f"shorter than {rules.rest_time:g} s")
    if best.point is not None and np.all(formation_error(run, best.point)[recent] <= rules.tolerance):
        return Outcome("converged")
    changed = last_change(run)
    window = _last(time[changed:], min(rules.trend_time, float(time[-1] - time[changed])))
    if time[-1] - time[changed] < rules.rest_time - CLOCK_ROUNDING or window is None:
        since = format_significant(float(time[-1] - time[changed]), 3)
        return Outcome("unfinished", f"the reference changed {since} s before the end")
    target = run.ticks.reference[-1] if best.point is None else best.point
    seen = slice(changed + window.start, None)
    distance = formation_error(run, target)[seen]
    found = trend(time[seen], run.ticks.hand_true[seen], distance, rules.rest_speed, rules.tolerance)
    at_rest = np.all(net_speed(run.ticks.hand_true[recent], time[recent]) < rules.rest_speed)
    word = "stuck" if at_rest else WORDS[found.direction]
    if at_rest and found.extent > rules.tolerance:  # of the way to where it rests
        found = replace(found, extent=extent_of(run.ticks.hand_true[recent]))
    text = _trend_text(word, found, float(distance[-1]))
    if found.arrival <= time[-1]:
        text = f"there for less than {rules.rest_time:g} s"
    elif word == "stuck" and best.point is None and at_governed_reference(run, recent):
        text += ", at the governed m"
    reason = "; ".join(filter(None, (text, best.reason)))
    return Outcome(word, reason, trend=found)


def _last(time: np.ndarray, seconds: float) -> slice | None:
    """Return the ticks of the last `seconds`, both ends included; None when there are not so many."""
    first = int(np.searchsorted(time, time[-1] - seconds + CLOCK_ROUNDING, side="right")) - 1
    return slice(first, None) if first >= 0 and len(time) - first >= 3 else None


def last_change(run: Run) -> int:
    """Return the row of the tick at which r took its last value."""
    changes = np.flatnonzero(np.any(np.diff(run.ticks.reference, axis=0) != 0, axis=1)) + 1
    return int(changes[-1]) if len(changes) else 0


def _trend_text(word: Word, found: Trend, distance: float) -> str:
    """Return the numbers that belong to a word."""
    short = f"{format_significant(distance, 2)} m short"
    if word in ("stuck", "stalled"):
        hunting = f", hunting within {format_significant(1e3 * found.extent, 2)} mm" if found.extent > HUNTING else ""
        return f"{short}{hunting if word == 'stuck' else ''}"
    if word == "circling":
        return f"{short}, within {format_significant(found.extent, 2)} m"
    speed = f"at {format_significant(1e3 * abs(found.rate), 2)} mm/s"
    if word == "receding":
        return f"{speed}, {short}"
    if np.isinf(found.arrival):
        return f"{speed}, extrapolated to level off {format_significant(found.limit, 2)} m short"
    arrival = f"{format_significant(found.arrival, 4)} s"
    if np.isnan(found.limit):
        return f"{speed}, there at {arrival} at this speed"
    return f"{speed}, extrapolated to arrive at {arrival}"


def at_governed_reference(run: Run, ticks: slice) -> bool:
    """Tell whether every robot is within `outcome.tolerance` of its place m_j + b_j at all these ticks."""
    off = run.ticks.hand_true[ticks] - run.ticks.m[ticks] - np.array(run.scenario.team.formation)
    return bool(np.all(np.linalg.norm(off, axis=-1) <= run.scenario.outcome.tolerance))


def net_speed(hand: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the distance between first and last position over the time between (n,) [m/s]; hand (W, n, 2).

    Net, not along the path: a motor that hunts about its position is at rest.
    """
    return np.linalg.norm(hand[-1] - hand[0], axis=-1) / (time[-1] - time[0])
