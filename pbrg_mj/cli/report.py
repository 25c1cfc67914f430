"""`pbrg report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.cli.compare import open_log


def report(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Logs, side by side.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="REPORT", help="REPORT.html.")],
) -> None:
    """Write one self-contained page: numbers, figures, a film seen from above, the scenario."""
    from pbrg_mj.analysis.output_file import by_suffix
    from pbrg_mj.analysis.report.page import SUFFIXES, write_page
    from pbrg_mj.analysis.report.report_run import report_run

    by_suffix(output, SUFFIXES)  # before the logs are read, which takes longer
    # A log at a time: only what the page shows is kept.
    write_page([report_run(open_log(log), len(logs)) for log in logs], output)
