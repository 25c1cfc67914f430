"""`pbrg tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.arguments import Force, without_drawing
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.study import Backend, Jobs, Json, Scheduler, StudyFolder, counting


def tune(
    file: Annotated[Path, typer.Argument(metavar="TUNE.yaml", help="What to tune, on which runs.")],
    output: StudyFolder,
    jobs: Jobs = None,
    backend: Backend = "joblib",
    scheduler: Scheduler = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Search the values of keys that are best on training seeds. The same command goes on after a kill."""
    without_drawing()
    with counting() as watch:
        made = pbrg.tune(file, output, watch=watch, jobs=jobs, backend=backend, scheduler=scheduler, force=force)
    if json:
        emit_json(made.as_dict())
        return 0
    best, given = made.best, made.trace[0]["value"]
    keys = ", ".join(f"{key}={value}" for key, value in best["keys"].items()) or "as given"
    emit(f"best of {len(made.trace)} trials: {best['value']:.4g} with {keys}; as given: {given:.4g}")
    if made.held_out:
        emit(f"on other seeds: {made.held_out['best']:.4g}; as given: {made.held_out['as_given']:.4g}")
    return 0
