"""`pbrg report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import PAGES, check_logs, check_output
from pbrg_mj.cli.arguments import Force


def report(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, side by side.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="REPORT", help="REPORT.html.")],
    force: Force = False,
) -> None:
    """Write one self-contained page: numbers, figures, a video seen from above, the scenario."""
    check_output(output, PAGES, force=force)
    check_logs(*logs)
    pbrg.report(logs, output)
