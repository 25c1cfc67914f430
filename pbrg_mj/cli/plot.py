"""`pbrg plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.cli.compare import open_log


def plot(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log to read.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FIG", help="FIG.pdf, FIG.png or FIG.svg.")],
) -> None:
    """Draw trajectories with the line, and governed references over time."""
    from pbrg_mj.analysis.atomic import by_suffix
    from pbrg_mj.analysis.plot import METADATA
    from pbrg_mj.analysis.plot import plot as draw

    by_suffix(output, METADATA)
    draw(open_log(log), output)
