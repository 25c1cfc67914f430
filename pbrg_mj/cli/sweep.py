"""`pbrg sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_study_file
from pbrg_mj.cli.arguments import ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.study import Json, Study, StudyFolder, with_study_options
from pbrg_mj.text import counted


@with_study_options
def sweep(
    study: Study,
    file: Annotated[Path, typer.Argument(metavar="SWEEP.yaml", help="Which runs to make.")],
    output: StudyFolder,
    json: Json = False,
) -> int:
    """Make the runs that a file lists; write one table of records. The same command goes on after a kill.

    A run that fails is a row of the table.
    """
    check_study_file(file)
    ignore_mujoco_gl()
    made = study(pbrg.sweep, file, output)
    if json:
        emit_json({**made.summary(), "records": str(made.path)})
        return 0
    outcomes = ", ".join(f"{count} {word}" for word, count in made.summary()["outcomes"].items())
    emit(f"{made.path}: {counted(len(made), 'run')}, {made.failed} failed{': ' if outcomes else ''}{outcomes}")
    return 0
