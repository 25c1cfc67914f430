"""`pbrg tune`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_study_file
from pbrg_mj.cli.arguments import ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.study import Json, Study, StudyFolder, with_study_options
from pbrg_mj.text import counted, format_significant


@with_study_options
def tune(
    study: Study,
    file: Annotated[Path, typer.Argument(metavar="TUNE.yaml", help="What to tune, on which runs.")],
    output: StudyFolder,
    json: Json = False,
) -> int:
    """Search the values of keys that are best on training seeds. The same command goes on after a kill."""
    check_study_file(file)
    ignore_mujoco_gl()
    made = study(pbrg.tune, file, output)
    if json:
        emit_json(made.as_dict())
        return 0
    best = made.best
    keys = ", ".join(f"{key}={value}" for key, value in best["keys"].items()) or "as given"
    value, as_given = (format_significant(one, 4) for one in (best["value"], made.trace[0]["value"]))
    emit(f"best of {counted(len(made.trace), 'trial')}: {value} with {keys}; as given: {as_given}")
    if made.held_out:
        value, as_given = (format_significant(made.held_out[one], 4) for one in ("best", "as_given"))
        emit(f"on other seeds: {value}; as given: {as_given}")
    return 0
