"""`pbrg export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.cli.compare import open_log


def export(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The log to read.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="OUT.npz, OUT.mat or OUT.csv.")],
) -> None:
    """Write a log's time series for NumPy, MATLAB or pandas."""
    from pbrg_mj.analysis.export import WRITERS
    from pbrg_mj.analysis.export import export as write
    from pbrg_mj.analysis.output_file import by_suffix

    by_suffix(output, WRITERS)  # before the log is read, which takes longer
    write(open_log(log), output)
