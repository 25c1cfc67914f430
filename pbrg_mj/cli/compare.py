"""`pbrg compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrg_mj.cli.console import emit, emit_json, note

if TYPE_CHECKING:
    from pbrg_mj.log.read.run import Run


def compare(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, a column each.")],
    json: Annotated[bool, typer.Option("--json", help="Print a JSON array, an object per log.")] = False,
) -> None:
    """Compare the distributed answer with the centralized optimum: one table."""
    from pbrg_mj.analysis.metrics.run_metrics import metrics
    from pbrg_mj.analysis.metrics.table import comparison_table

    # A log at a time: only the numbers are kept.
    numbers = [metrics(open_log(log)) for log in logs]
    if json:
        emit_json([one.as_dict() for one in numbers])
    else:
        emit(comparison_table(numbers))


def open_log(path: Path) -> Run:
    """Return the log's run; one line on stderr tells of damage. Raises InputError when it is no log."""
    from pbrg_mj.log.read.run import open_run

    run = open_run(path)
    if run.damage:
        note(f"warning: {path}: {run.damage}")
    return run
