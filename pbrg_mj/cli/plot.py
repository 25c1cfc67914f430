"""`pbrg plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.cli.compare import open_log

PAPER = "trajectories,references"


def plot(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log to read.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FIG", help="FIG.pdf, FIG.png or FIG.svg.")],
    panels: Annotated[
        str, typer.Option(help="trajectories,references,margin,gap,consensus,multipliers or all, in this order.")
    ] = PAPER,
) -> None:
    """Draw the paper's two figures, trajectories with the line and references over time, or other panels."""
    from pbrg_mj.analysis.figures.figure import METADATA, PANELS, check_panels
    from pbrg_mj.analysis.figures.figure import plot as draw
    from pbrg_mj.analysis.output_file import by_suffix

    by_suffix(output, METADATA)
    wanted = tuple(PANELS) if panels == "all" else tuple(dict.fromkeys(filter(None, panels.split(","))))
    check_panels(wanted)
    draw(open_log(log), output, wanted)
