"""A log again: simulated once more and compared bit for bit, or repaired."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.api.log_reading import LOG
from pbrg_mj.api.run import Run
from pbrg_mj.errors import InputError
from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.messaging.program import RobotProgram
from pbrg_mj.governor.problem.interface import Certificate, Governor
from pbrg_mj.log import repair as repairing
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.log.verify import replay as verifying
from pbrg_mj.log.write.log_file import check_writable
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.perception.estimator import Estimator
from pbrg_mj.plugins import Objects
from pbrg_mj.sensing.noise_model import NoiseModel
from pbrg_mj.text import counted

# Other processors and versions round otherwise. Where that has grown past this, in a value's own unit, it no longer
# is the same run.
TOLERANCE = 1e-6
MOST_LINES = 20
MODELLED_BY = ("pbrg_mj", "mujoco")


@dataclass(frozen=True)
class Verification:
    """What a replay found."""

    found: verifying.Verification
    tolerance: float

    @property
    def verdict(self) -> str:
        """`identical` or `differs`; elsewhere `within tolerance`, `beyond tolerance`, or `another model`."""
        if self.found.first is None:
            return "identical"
        if not self.found.environment_changes:
            return "differs"
        if self.found.other_model:
            return "another model"
        return "within tolerance" if self.found.within(self.tolerance) else "beyond tolerance"

    @property
    def ok(self) -> bool:
        """Whether the replay is the logged run."""
        return self.verdict in ("identical", "within tolerance")

    def lines(self) -> list[str]:
        """Return it as text."""
        found = self.found
        held = f"{counted(found.ticks, 'tick')}, {counted(found.messages, 'message')}"
        span = f"{held}, up to {found.end:g} of {found.duration:g} s"
        if found.first is None:
            short = "" if found.complete else f"; the log ends there: {found.ended}"
            return [f"identical: {span}; every channel but /timing, bit for bit{short}"]
        first = f"differs first at {_place(found.first)}: {_values(found.first)}"
        if not found.environment_changes:
            return [first]
        if found.other_model:
            return [f"another model: {_versions(found)}; {first}; no tick is compared"]
        lines = [
            f"{name}: the log was made with {then}, here is {now}"
            for name, (then, now) in found.environment_changes.items()
        ]
        lines += [first, "largest deviation of each field, each in its own unit:"]
        ordered = sorted(found.deviations.values(), key=lambda one: -one.difference.size)
        lines += [f"  {_size(one):<10} {_place(one)}: {_values(one)}" for one in ordered[:MOST_LINES]]
        if len(ordered) > MOST_LINES:
            lines.append(f"  and {len(ordered) - MOST_LINES} smaller ones")
        end = f"{self.verdict} ({self.tolerance:g}): {span}; another environment need not give the same bits"
        return [*lines, end]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        found = self.found
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "ticks": found.ticks,
            "messages": found.messages,
            "end_s": found.end,
            "duration_s": found.duration,
            "complete": found.complete,
            "ended": found.ended,
            "damage": found.damage,
            "first": _mismatch(found.first) if found.first else None,
            "foreign": {name: {"log": then, "here": now} for name, (then, now) in found.environment_changes.items()},
            "deviations": [_mismatch(one) for one in found.deviations.values()] if found.environment_changes else [],
        }

    def __repr__(self) -> str:
        """Show the text."""
        return "\n".join(self.lines())


@dataclass(frozen=True)
class Repair:
    """What a repair kept."""

    path: Path  # of the clean log
    damage: tuple[str, ...]  # of the old one, each in one line
    kept_ticks: int
    chunks: int  # kept
    lost: int  # chunks left out
    ticks: tuple[tuple[int, int], ...]  # first and last index of the blocks of ticks without a gap

    def lines(self) -> list[str]:
        """Return it as text."""
        lost = f", {self.lost} left out" if self.lost else ""
        lines = [f"{self.path}: {counted(self.kept_ticks, 'tick')} in {counted(self.chunks, 'chunk')}{lost}"]
        if self.ticks[0][0] > 0:
            lines.append("its first ticks are lost: MCAP viewers open it, the other commands need tick 0")
        elif len(self.ticks) > 1:
            after, before = self.ticks[0][1], self.ticks[1][0]
            gap = f"ticks {after + 1} to {before - 1} are lost"
            lines.append(f"{gap}: MCAP viewers see the rest, other commands end there")
        return lines


def verify(
    log: Run | str | Path,
    governor: Governor | RobotProgram | None = None,
    *,
    certificate: Certificate | None = None,
    estimator: Estimator | None = None,
    noise_model: NoiseModel | None = None,
    reference_solver: CentralizedSolver | None = None,
    tolerance: float = TOLERANCE,
    watch: Callable[[TickRecord], object] = lambda record: None,
) -> Verification:
    """Simulate a log's scenario again and compare every message, bit for bit.

    A run with parts that were objects needs those objects again, under the names that `run` has for them. `tolerance`
    is the largest deviation, each in its own unit, in another environment than the log's. `watch` is called with every
    record of the replay.

    Raises InputError when the file is no log of this package, or its scenario cannot be run here.
    """
    objects = Objects(governor, certificate, estimator, noise_model, reference_solver)
    if isinstance(log, Run):
        with log.file() as recorded:
            found = verifying.verify(Path(recorded.path), watch, objects)
    else:
        found = verifying.verify(Path(log), watch, objects)
    if found.damage:
        LOG.warning("%s: %s", log, found.damage)
    return Verification(found, tolerance)


def logged_duration(log: str | Path) -> float:
    """Return the duration of a log's scenario [s], whatever the log holds of it. Raises InputError."""
    return read_header(Path(log)).scenario.timing.duration


def repair(log: str | Path, path: str | Path, *, force: bool = False) -> Repair:
    """Write a clean log (.mcap) to `path` of all that is whole in a damaged one, which stays as it is.

    `force` allows to replace a log that exists. Raises InputError when it may not be replaced, the file is no log of
    this package, or it holds no whole chunk.
    """
    log, path = Path(log), Path(path)
    by_suffix(path, {".mcap": None})
    if path.exists() and log.exists() and path.samefile(log):
        raise InputError("would overwrite the log itself; give another name", file=str(path))
    check_writable(path, force=force)
    found: list[repairing.RepairReport] = []
    write_atomically(path, lambda whole: found.append(repairing.repair(log, whole)))
    one = found[0]
    if one.damage:
        LOG.warning("%s: %s", log, _each_once(one.damage))
    return Repair(path, tuple(one.damage), one.kept_ticks, one.chunks, one.lost, tuple(one.ticks))


def _each_once(damage: Sequence[str]) -> str:
    """Return all damage in one line, what occurs more than once with its count."""
    counts = Counter(damage)
    return "; ".join(f"{what} ({count} times)" if count > 1 else what for what, count in counts.items())


def _versions(found: verifying.Verification) -> str:
    """Return with which versions of what the model depends on the log was made, and which are here."""
    changed = [(name, *pair) for name, pair in found.environment_changes.items() if name.startswith(MODELLED_BY)]
    if not changed:
        return "the log was made elsewhere"
    then, now = (", ".join(f"{change[0]} {change[k]}" for change in changed) for k in (1, 2))
    return f"the log was made with {then}, here is {now}"


def _place(one: verifying.Mismatch) -> str:
    return f"{one.time:.9g} s on {one.channel}: {one.difference.field}"


def _values(one: verifying.Mismatch) -> str:
    return f"the log has {one.difference.logged}, the replay {one.difference.replayed}"


def _size(one: verifying.Mismatch) -> str:
    return f"{one.difference.size:.3g}" if math.isfinite(one.difference.size) else "differs"


def _mismatch(one: verifying.Mismatch) -> dict[str, Any]:
    size = one.difference.size
    return {
        "channel": one.channel,
        "time_s": one.time,
        "field": one.difference.field,
        "log": one.difference.logged,
        "replay": one.difference.replayed,
        "size": size if math.isfinite(size) else None,
    }
