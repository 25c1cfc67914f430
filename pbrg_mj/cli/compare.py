"""`pbrg compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_logs
from pbrg_mj.cli.console import emit, emit_json


def compare(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, a column each.")],
    json: Annotated[bool, typer.Option("--json", help="Print a JSON array, an object per log.")] = False,
    metric: Annotated[
        list[str] | None, typer.Option("--metric", metavar="NAME", help="Add a plug-in's metric; repeatable.")
    ] = None,
) -> None:
    """Compare the distributed answer with the centralized optimum: one table."""
    check_logs(*logs)
    compared = pbrg.compare(*logs, metrics=metric or ())
    if json:
        emit_json(compared.as_dicts())
    else:
        emit(compared.table())
