"""`pbrg replay`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_logs
from pbrg_mj.cli.arguments import Log, ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.progress import progress
from pbrg_mj.errors import InputError


def replay(
    log: Log,
    verify: Annotated[bool, typer.Option("--verify", help="Run it again and compare, bit for bit.")] = False,
    tolerance: Annotated[
        float, typer.Option(help="Largest deviation, in its own unit, in another environment than the log's.")
    ] = 1e-6,
    view: Annotated[bool, typer.Option("--view", help="Show it in MuJoCo's window; needs a display.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print what is found as JSON, and nothing else.")] = False,
) -> int:
    """Step through a log; with --verify, run its scenario again and compare. Exit code 1 when they differ."""
    if not tolerance >= 0:
        raise InputError(f"--tolerance is {tolerance:g}; allowed: 0 or more")
    if view and verify:
        raise InputError("--view and --verify do not go together; allowed: one of them")
    check_logs(log)
    if view:
        pbrg.open(log).view()
        return 0
    return _verify(log, tolerance, json=json) if verify else _replay(log, json=json)


def _replay(log: Path, *, json: bool) -> int:
    from pbrg_mj.api.logs import replay_log

    seen = replay_log(log)
    if json:
        emit_json(seen.as_dict())
    else:
        emit("\n".join(seen.lines()))
    return 0


def _verify(log: Path, tolerance: float, *, json: bool) -> int:
    ignore_mujoco_gl()
    from pbrg_mj.api.replay import logged_duration

    with progress(logged_duration(log), not json) as shown:
        found = pbrg.verify(log, tolerance=tolerance, watch=shown)
    if json:
        emit_json(found.as_dict())
    else:
        emit("\n".join(found.lines()))
    return 0 if found.ok else 1
