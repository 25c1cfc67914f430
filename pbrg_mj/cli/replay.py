"""`pbrg replay`."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrg_mj.cli.compare import open_log
from pbrg_mj.cli.console import emit, emit_json, note
from pbrg_mj.cli.progress import progress
from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.log.verify.replay import Mismatch, Verification

# Other processors and versions round otherwise. Where that has grown past this, in a value's own unit, it no longer
# is the same run.
TOLERANCE = 1e-6
MOST_LINES = 20


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log to read.")],
    verify: Annotated[bool, typer.Option("--verify", help="Run it again and compare, bit for bit.")] = False,
    tolerance: Annotated[
        float, typer.Option(help="Largest deviation, in its own unit, in another environment than the log's.")
    ] = TOLERANCE,
    view: Annotated[bool, typer.Option("--view", help="Show it in MuJoCo's window; needs a display.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print what is found as JSON, and nothing else.")] = False,
) -> int:
    """Step through a log; with --verify, run its scenario again and compare. Exit code 1 when they differ."""
    if not tolerance >= 0:
        raise InputError(f"--tolerance is {tolerance:g}; allowed: 0 or more")
    if view:
        return _show(log, verify=verify)
    return _verify(log, tolerance, json=json) if verify else _account(log, json=json)


def _show(log: Path, *, verify: bool) -> int:
    if verify:
        raise InputError("--view and --verify do not go together; allowed: one of them")
    from pbrg_mj.video.viewer import view

    view(open_log(log))
    return 0


def _account(log: Path, *, json: bool) -> int:
    from pbrg_mj.analysis.replay_summary import replay_summary

    told = replay_summary(open_log(log))
    if json:
        emit_json(told.as_dict())
    else:
        emit("\n".join(told.lines()))
    return 0


def _verify(log: Path, tolerance: float, *, json: bool) -> int:
    # As for a run: nothing here draws.
    os.environ.pop("MUJOCO_GL", None)
    from pbrg_mj.log.read.ticks import read_header
    from pbrg_mj.log.verify.replay import verify

    duration = read_header(log).scenario.timing.duration
    with progress(duration, not json) as shown:
        found = verify(log, shown)
    if found.damage:
        note(f"warning: {log}: {found.damage}")
    verdict = _verdict(found, tolerance)
    if json:
        emit_json(_as_dict(found, verdict, tolerance))
    else:
        emit("\n".join(_lines(found, verdict, tolerance)))
    return 0 if verdict in ("identical", "within tolerance") else 1


def _verdict(found: Verification, tolerance: float) -> str:
    if found.first is None:
        return "identical"
    if not found.environment_changes:
        return "differs"
    return "within tolerance" if found.within(tolerance) else "beyond tolerance"


def _lines(found: Verification, verdict: str, tolerance: float) -> list[str]:
    span = f"{found.ticks} ticks, {found.messages} messages, up to {found.end:g} of {found.duration:g} s"
    if found.first is None:
        short = "" if found.complete else "; the log ends there"
        return [f"identical: {span}; every channel but /timing, bit for bit{short}"]
    first = f"differs first at {_place(found.first)}: {_values(found.first)}"
    if not found.environment_changes:
        return [first]
    lines = [
        f"{name}: the log was made with {then}, here is {now}"
        for name, (then, now) in found.environment_changes.items()
    ]
    lines += [first, "largest deviation of each field, each in its own unit:"]
    ordered = sorted(found.deviations.values(), key=lambda one: -one.difference.size)
    lines += [f"  {_size(one):<10} {_place(one)}: {_values(one)}" for one in ordered[:MOST_LINES]]
    if len(ordered) > MOST_LINES:
        lines.append(f"  and {len(ordered) - MOST_LINES} smaller ones")
    return [*lines, f"{verdict} ({tolerance:g}): {span}; another environment need not give the same bits"]


def _place(one: Mismatch) -> str:
    return f"{one.time:.9g} s on {one.channel}: {one.difference.field}"


def _values(one: Mismatch) -> str:
    return f"the log has {one.difference.logged}, the replay {one.difference.replayed}"


def _size(one: Mismatch) -> str:
    return f"{one.difference.size:.3g}" if math.isfinite(one.difference.size) else "differs"


def _as_dict(found: Verification, verdict: str, tolerance: float) -> dict[str, Any]:
    return {
        "verdict": verdict,
        "tolerance": tolerance,
        "ticks": found.ticks,
        "messages": found.messages,
        "end_s": found.end,
        "duration_s": found.duration,
        "complete": found.complete,
        "damage": found.damage,
        "first": _mismatch(found.first) if found.first else None,
        "foreign": {name: {"log": then, "here": now} for name, (then, now) in found.environment_changes.items()},
        "deviations": [_mismatch(one) for one in found.deviations.values()] if found.environment_changes else [],
    }


def _mismatch(one: Mismatch) -> dict[str, Any]:
    size = one.difference.size
    return {
        "channel": one.channel,
        "time_s": one.time,
        "field": one.difference.field,
        "log": one.difference.logged,
        "replay": one.difference.replayed,
        "size": size if math.isfinite(size) else None,
    }
