"""`pbrg reproduce`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import PAPER, check_paper_folder
from pbrg_mj.cli.arguments import Force, ignore_mujoco_gl
from pbrg_mj.cli.console import emit, emit_json, note
from pbrg_mj.cli.progress import progress

if TYPE_CHECKING:
    from pbrg_mj import Scenario, TickRecord


def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill.")],
    force: Force = False,
    duration: Annotated[float | None, typer.Option(help="Simulated time of every run [s], less than the full.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON, and nothing else.")] = False,
) -> int:
    """Make the paper's four runs: logs, figures as PDF and PNG, numbers.md and numbers.json.

    The same files at every repetition: wall-clock times are left out. Exit code 1 when a run was violated or diverged.
    """
    ignore_mujoco_gl()
    check_paper_folder(output, force=force)

    numbers = count(1)

    @contextmanager
    def watch(scenario: Scenario) -> Iterator[Callable[[TickRecord], None]]:
        if sys.stderr.isatty():
            note(f"{next(numbers)} of {len(PAPER)}: {scenario.name.removeprefix('paper/')}")
        with progress(scenario.settings.timing.duration, True) as shown:
            yield shown

    try:
        made = pbrg.reproduce(output, duration=duration, force=force, watch=watch)
    except pbrg.Interrupted as error:
        note(f"interrupted; {error}")
        return 128 + error.signal
    if json:
        emit_json(made.as_dicts())
    else:
        emit(made.markdown().rstrip("\n"))
    return 1 if made.failed else 0
