"""`pbrg bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.arguments import ignore_mujoco_gl
from pbrg_mj.cli.console import emit, note
from pbrg_mj.cli.study import Study, with_study_options
from pbrg_mj.errors import InputError


@with_study_options
def bench(
    study: Study,
    suite: Annotated[str | None, typer.Argument(metavar="SUITE", help="A suite's file, or: standard.")] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill, or go on with.")
    ] = Path("bench"),
    quick: Annotated[bool, typer.Option("--quick", help="The suite's smaller one.")] = False,
    verify: Annotated[
        Path | None, typer.Option("--verify", metavar="DIR", help="Replay a folder's logs; make its table from them.")
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option("--against", metavar="FILE", help="With --verify: hold its logs to another release's manifest."),
    ] = None,
    release: Annotated[
        Path | None,
        typer.Option("--release", metavar="DIR", help="Write SHA-256 of a finished folder's files into it."),
    ] = None,
) -> int:
    """Run a suite of worlds under all its governors; write one table, its page and its logs.

    The same command goes on after a kill. Exit code 1 when --verify finds that logs or table are not what they say, or
    not those that were released.
    """
    ignore_mujoco_gl()
    if against is not None and verify is None:
        raise InputError("--against goes with --verify; allowed: pbrg bench --verify DIR --against FILE")
    for option, folder in (("--verify", verify), ("--release", release)):
        if folder is not None and (suite is not None or quick or None not in (verify, release)):
            raise InputError(f"{option} takes a folder alone; allowed: pbrg bench {option} DIR")
    if verify is not None:
        return _verify(study, verify, against)
    if release is not None:
        study.refuse("--release")
        emit(str(pbrg.release_bench(release)))
        return 0
    made = study(pbrg.bench, suite or "standard", output, quick=quick)
    emit(made.table())
    emit("")
    emit(made.wall_clock())
    note(f"written: {made.folder / 'index.html'}, table.md, wall_clock.md, runs.md, records.parquet, logs")
    return 0


def _verify(study: Study, folder: Path, against: Path | None) -> int:
    found = study.with_jobs("--verify", pbrg.verify_bench, folder, against=against)
    emit(found.bench.table())
    emit("")
    emit(found.bench.wall_clock())
    worlds = f"the worlds of the suite {found.suite}" if found.suite else "worlds of its own suite"
    emit("")
    for problem in found.problems:
        emit(problem)
    if found.release:
        emit(f"as released in {found.release}")
    if against is not None and found.ok:
        emit(f"every log has the messages of those released in {against}")
    emit(f"{worlds}; {found.verdict()}")
    return 0 if found.ok else 1
