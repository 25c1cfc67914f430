"""`pbrg export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pbrg_mj.api.files import ARRAYS, check_logs, check_output
from pbrg_mj.cli.arguments import Force, Log


def export(
    log: Log,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT", help="OUT.npz, OUT.mat or OUT.csv.")],
    force: Force = False,
) -> None:
    """Write a log's time series for NumPy, MATLAB or pandas."""
    check_output(output, ARRAYS, force=force)
    check_logs(log)
    from pbrg_mj.api.logs import export_log

    export_log(log, output)
