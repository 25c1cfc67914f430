"""`pbrg sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.arguments import Force, without_drawing
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.study import Backend, Jobs, Json, Scheduler, StudyFolder, counting


def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP.yaml", help="Which runs to make.")],
    output: StudyFolder,
    jobs: Jobs = None,
    backend: Backend = "joblib",
    scheduler: Scheduler = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Make the runs that a file lists; write one table of records. The same command goes on after a kill.

    A run that fails is a row of the table.
    """
    without_drawing()
    options = {"jobs": jobs, "backend": backend, "scheduler": scheduler, "force": force}
    with counting() as watch:
        made = pbrg.sweep(file, output, watch=watch, **options)
    if json:
        emit_json({**made.summary(), "records": str(made.path)})
        return 0
    outcomes = ", ".join(f"{count} {word}" for word, count in made.summary()["outcomes"].items())
    emit(f"{made.path}: {len(made)} runs, {made.failed} failed{': ' if outcomes else ''}{outcomes}")
    return 0
