"""`pbrg repair`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_logs
from pbrg_mj.cli.arguments import Force
from pbrg_mj.cli.console import emit


def repair(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The damaged log; it stays as it is.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="OUT.mcap", help="The clean log to write.")],
    force: Force = False,
) -> None:
    """Write a clean log of all that is whole in a damaged one."""
    check_logs(log)
    emit("\n".join(pbrg.repair(log, output, force=force).lines()))
