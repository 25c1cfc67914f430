"""`pbrg plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.api.files import FIGURES, check_logs, check_output
from pbrg_mj.cli.arguments import Force, Log

PAPER = "trajectories,references"


def plot(
    log: Log,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FIG", help="FIG.pdf, FIG.png or FIG.svg.")],
    panels: Annotated[
        str, typer.Option(help="trajectories,references,margin,gap,consensus,multipliers or all, in this order.")
    ] = PAPER,
    force: Force = False,
) -> None:
    """Draw the paper's two figures, trajectories with the line and references over time, or other panels."""
    check_output(output, FIGURES, force=force)
    check_logs(log)
    from pbrg_mj.api.logs import plot_log

    plot_log(log, output, panels)
