"""What commands of many runs share: their options, and progress with the time left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.arguments import Force
from pbrg_mj.cli.console import note
from pbrg_mj.text import counted

StudyFolder = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill, or go on with.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Study = Callable[..., Any]
"""Called with a function of the API and its arguments; gives it the options of all studies, and a progress bar."""


def _options(
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one for each core if not given.")] = None,
    backend: Annotated[str, typer.Option(help="joblib: this machine; dask: the workers of --scheduler.")] = "joblib",
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Of Dask, such as tcp://host:8786.")] = None,
    force: Force = False,
) -> dict[str, Any]:
    """Return the options that all studies have."""
    return {"jobs": jobs, "backend": backend, "scheduler": scheduler, "force": force}


def with_study_options(command: Callable[..., int]) -> Callable[..., int]:
    """Return a command that has the options of all studies in place of its parameter `study`."""
    own, shared = (signature(one, eval_str=True).parameters for one in (command, _options))

    def extended(**given: Any) -> int:
        options = _options(**{name: given.pop(name) for name in shared})

        def study(function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
            with study_progress() as watch:
                return function(*arguments, **more, **options, watch=watch)

        return command(**given, study=study)

    kept = [one for one in own.values() if one.name != "study"]
    added = [one.replace(kind=Parameter.KEYWORD_ONLY) for one in shared.values()]
    extended.__doc__, extended.__name__ = command.__doc__, command.__name__
    extended.__annotations__ = {one.name: one.annotation for one in (*kept, *added)}
    vars(extended)["__signature__"] = Signature([*kept, *added])  # which typer reads
    return extended


@contextmanager
def study_progress() -> Iterator[Callable[[int, int, int], None]]:
    """Give a function to call with the numbers of runs over, of all and of failed ones.

    An interruption is reported, and is the command's exit code.
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
            description = f"{done} of {counted(total, 'run')}" + (f", {failed} failed" if failed else "")
            bar.update(task, total=total, completed=done, description=description)

        yield show
