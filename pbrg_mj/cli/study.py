"""What commands of many runs share: their options, and progress with the time left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.console import note

StudyFolder = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill, or go on with.")]
Jobs = Annotated[int | None, typer.Option("--jobs", min=1, help="Processes; one for each core if not given.")]
Backend = Annotated[str, typer.Option(help="joblib: this machine; dask: the workers of --scheduler.")]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Of Dask, such as tcp://host:8786.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


@contextmanager
def counting() -> Iterator[Callable[[int, int, int], None]]:
    """Give a function to call with the numbers of runs over, of all and of failed ones.

    An interruption is told, and is the command's exit code.
    """
    try:
        with _bar() as watch:
            yield watch
    except pbrg.Interrupted as error:
        note(f"interrupted; {error}")
        raise typer.Exit(128 + error.signal) from None


@contextmanager
def _bar() -> Iterator[Callable[[int, int, int], None]]:
    """Give what draws a bar, on a terminal alone."""
    if not sys.stderr.isatty():
        yield lambda _done, _total, _failed: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (BarColumn(bar_width=20), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(
        *columns, TextColumn("left:"), TimeRemainingColumn(), console=Console(stderr=True), transient=True
    ) as bar:
        task = bar.add_task("starting", total=None)

        def show(done: int, total: int, failed: int) -> None:
            told = f"{done} of {total} runs" + (f", {failed} failed" if failed else "")
            bar.update(task, total=total, completed=done, description=told)

        yield show
