"""What commands of many runs share: their options, and progress with the time left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.arguments import Force
from pbrg_mj.cli.console import note
from pbrg_mj.errors import InputError
from pbrg_mj.text import counted

StudyFolder = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill, or go on with.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


@dataclass(frozen=True)
class Study:
    """The options of all studies, as they were given."""

    jobs: int | None
    backend: str
    scheduler: str | None
    force: bool

    def __call__(self, function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        """Call a function of the API with its arguments, these options and a progress bar."""
        with study_progress() as watch:
            return function(*arguments, **more, **asdict(self), watch=watch)

    def with_jobs(self, what: str, function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        """Call a function that takes of these options `jobs` alone, for the option `what`. Raises InputError."""
        self.refuse(what, but="jobs")
        with study_progress() as watch:
            return function(*arguments, **more, jobs=self.jobs, watch=watch)

    def refuse(self, what: str, but: str | None = None) -> None:
        """Raise InputError when another of these options than `but` was given beside the option `what`."""
        for one in fields(self):
            default = signature(_options).parameters[one.name].default
            if one.name != but and getattr(self, one.name) != default:
                allowed = f"; allowed: --{but}" if but else ""
                raise InputError(f"--{one.name} does not go with {what}{allowed}")


def _options(
    jobs: Annotated[int | None, typer.Option(min=1, help="Processes; one for each core if not given.")] = None,
    backend: Annotated[str, typer.Option(help="joblib: this machine; dask: the workers of --scheduler.")] = "joblib",
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Of Dask, such as tcp://host:8786.")] = None,
    force: Force = False,
) -> Study:
    """Return the options that all studies have."""
    return Study(jobs, backend, scheduler, force)


def with_study_options(command: Callable[..., int]) -> Callable[..., int]:
    """Return a command that has the options of all studies in place of its parameter `study`."""
    own, shared = (signature(one, eval_str=True).parameters for one in (command, _options))

    def extended(**given: Any) -> int:
        study = _options(**{name: given.pop(name) for name in shared})
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
