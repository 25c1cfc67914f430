"""`pbrg falsify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_scenario, check_study_file
from pbrg_mj.cli.arguments import ScenarioName, ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json
from pbrg_mj.cli.study import Json, Study, StudyFolder, with_study_options
from pbrg_mj.text import counted, format_significant


@with_study_options
def falsify(
    study: Study,
    scenario: ScenarioName,
    search: Annotated[Path, typer.Option("--search", metavar="SPACE.yaml", help="What to search over, and for what.")],
    output: StudyFolder,
    budget: Annotated[int, typer.Option(min=1, help="Runs at most.")] = 200,
    json: Json = False,
) -> int:
    """Search for a contact, a crossing, a violated certificate or a stall; leave the shortest scenario with it.

    The same command goes on after a kill. Exit code 1 when a failure was found.
    """
    check_study_file(search)
    check_scenario(scenario)
    ignore_mujoco_gl()
    made = study(pbrg.falsify, scenario, search, output, budget=budget)
    if json:
        emit_json(made.as_dict())
    elif made.found is None:
        emit(f"no {made.kind} in {counted(made.runs, 'run')}; the nearest one by {format_significant(made.nearest, 3)}")
    else:
        shows = f"{made.path} shows it in {made.found['asked_s']:g} s with {counted(made.found['robots'], 'robot')}"
        shorter = f"after {counted(made.shrinking, 'run')} to make it shorter"
        emit(f"{made.kind} found in {counted(made.runs, 'run')}; {shows}, {shorter}")
    return 0 if made.found is None else 1
