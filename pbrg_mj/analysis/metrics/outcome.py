"""How a run ended, in one word."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from pbrg_mj.analysis.metrics.best_formation import BestFormation, best_formation
from pbrg_mj.analysis.metrics.contacts import FIELDS, Kind, contact_flags, is_violation, words
from pbrg_mj.analysis.metrics.margins import obstructed, static_margin
from pbrg_mj.log.read.run import Run

Violation = Kind | Literal["half-space"]
Word = Literal["converged", "moving", "stalled", "violated", "diverged"]
ROUNDING = 1e-6  # [m] a margin above -ROUNDING is on the line, not past it
CLOCK = 1e-9  # [s] rounding of tick times


@dataclass(frozen=True)
class Outcome:
    """The word, and what led to it where it needs saying; robot, time and kind of the first violation."""

    word: Word
    reason: str | None = None
    robot: int | None = None  # counted from 1
    time: float | None = None  # [s]
    kind: Violation | None = None  # with what


def outcome(run: Run) -> Outcome:
    """Return the outcome by ground truth: violated before diverged, before converged, stalled and moving."""
    return _violated(run) or _diverged(run) or _ended(run)


def formation_error(run: Run, point: ArrayLike) -> np.ndarray:
    """Return max_j ||q_j - b_j - point|| (T,) [m] with true hand points."""
    shifted = run.ticks.hand_true - np.array(run.scenario.team.formation)
    return np.linalg.norm(shifted - np.asarray(point), axis=-1).max(axis=-1)


def final_target(run: Run) -> BestFormation:
    """Return the best admissible formation for the last r."""
    return best_formation(run.scenario, run.ticks.reference[-1])


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
    behind = static_margin(run) < -ROUNDING
    if not obstructed(run.scenario):
        yield "half-space", behind, lambda _tick, _robot: "passed a given half-space"
    elif is_violation(run, "walls"):
        yield "walls", behind, lambda _tick, _robot: "passed a wall's line"
    if is_violation(run, "moving"):
        yield "moving", run.ticks.moving_margin < -ROUNDING, lambda _tick, _robot: "passed a moving box's line"


def _touched(run: Run, kind: Kind, tick: int, robot: int) -> str:
    return f"touched {words(run, kind, tick, robot)}"


def _diverged(run: Run) -> Outcome | None:
    limit = run.scenario.outcome.diverged_beyond
    if np.any(run.ticks.status == "diverged"):
        return Outcome("diverged", "the governor's estimates")
    values = (run.ticks.p, run.ticks.xi, run.ticks.m)
    if not all(np.isfinite(value).all() for value in values):
        return Outcome("diverged", "not finite")
    if any(np.any(np.abs(value) > limit) for value in values):
        return Outcome("diverged", f"beyond {limit:g} m")
    return None


def _ended(run: Run) -> Outcome:
    rules, time = run.scenario.outcome, run.ticks.time
    first = np.searchsorted(time, time[-1] - rules.rest_time + CLOCK, side="right") - 1
    if first < 0:
        return Outcome("moving", "shorter than rest_time")
    window = slice(first, None)
    best = final_target(run)
    if best.point is not None and np.all(formation_error(run, best.point)[window] <= rules.tolerance):
        return Outcome("converged")
    at_rest = np.all(net_speed(run.ticks.hand_true[window], time[window]) < rules.rest_speed)
    return Outcome("stalled" if at_rest else "moving", best.reason)


def net_speed(hand: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the distance between first and last position over the time between (n,) [m/s]; hand (W, n, 2).

    Net, not along the path: a motor that hunts about its position is at rest.
    """
    return np.linalg.norm(hand[-1] - hand[0], axis=-1) / (time[-1] - time[0])
