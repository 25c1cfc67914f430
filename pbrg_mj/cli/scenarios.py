"""`pbrg list` and `pbrg validate`."""

from __future__ import annotations

from typing import Annotated

import typer

from pbrg_mj.analysis.text import plain
from pbrg_mj.cli.console import emit, note
from pbrg_mj.errors import InputError


def list_scenarios() -> None:
    """List the bundled scenarios, a line each."""
    from pbrg_mj.scenario.bundled import bundled_scenarios
    from pbrg_mj.scenario.load import load_scenario

    files = bundled_scenarios()
    width = max(map(len, files), default=0)
    for name, file in files.items():
        description = " ".join(load_scenario(file).scenario.description.split())
        emit(f"{name:<{width}}  {description}".rstrip())


def validate(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Scenario files, or bundled names.")],
) -> int:
    """Check scenario files."""
    from pbrg_mj.loop.stability_warnings import stability_warnings
    from pbrg_mj.scenario.load import load_scenario

    wrong = 0
    for file in files:
        try:
            scenario = load_scenario(file).scenario
        except InputError as error:
            note(f"error: {error}")
            wrong += 1
        else:
            emit(f"{plain(file)}: ok, {scenario.robots} robots, {scenario.plant} plant, {scenario.timing.duration:g} s")
            for line in stability_warnings(scenario):
                note(f"warning: {plain(file)}: {line}")
    return 2 if wrong else 0
