"""`pbrg reproduce`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrg_mj.cli.compare import open_log
from pbrg_mj.cli.console import emit, note
from pbrg_mj.cli.run import FAILED, INTERRUPTED, record
from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.analysis.metrics.run_metrics import RunMetrics


def reproduce(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="The folder to fill.")],
    duration: Annotated[float | None, typer.Option(help="Simulated time of every run [s], less than the full.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON, and nothing else.")] = False,
) -> int:
    """Make the paper's four runs: logs, figures as PDF and PNG, numbers.md and numbers.json.

    The same files at every repetition: wall-clock times are left out. Exit code 1 when a run was violated or diverged.
    """
    os.environ.pop("MUJOCO_GL", None)  # as in `pbrg run`
    from pbrg_mj.analysis.metrics.paper_table import RUNS, as_json, markdown

    _prepare(output)
    done: list[RunMetrics] = []
    for number, name in enumerate(RUNS, start=1):
        if sys.stderr.isatty():
            note(f"{number} of {len(RUNS)}: {name}")
        log = _simulate(name, output, duration)
        if log is None:
            note(f"interrupted; whole in {output}: {', '.join(RUNS[: len(done)]) or 'nothing'}")
            return INTERRUPTED
        done.append(_evaluate(log))
        _write_numbers(done, output)
    emit((as_json if json else markdown)(done).rstrip("\n"))
    return 1 if any(one.outcome in FAILED for one in done) else 0


def _prepare(folder: Path) -> None:
    if find_spec("matplotlib") is None:  # before the runs, which take longer
        raise InputError("figures need matplotlib: pip install 'pbrg-mj[plot]'")
    if folder.exists() and not folder.is_dir():
        raise InputError("this is not a folder", file=str(folder))
    folder.mkdir(parents=True, exist_ok=True)


def _simulate(name: str, folder: Path, duration: float | None) -> Path | None:
    """Return the run's log, or None when interrupted: then nothing of it is left."""
    from pbrg_mj.scenario.load import load_scenario

    overrides = ["log.timings=false"]
    if duration is not None:
        overrides.append(f"timing.duration={duration}")
    loaded = load_scenario(f"paper/{name}", overrides)
    path, part = folder / f"{name}.mcap", folder / f".{name}-part.mcap"
    try:
        if not record(loaded, part, show=True):
            return None
        return part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _evaluate(log: Path) -> RunMetrics:
    """Draw the run's figures beside its log and return its numbers."""
    from pbrg_mj.analysis.figures.figure import plot
    from pbrg_mj.analysis.metrics.run_metrics import metrics

    run = open_log(log)
    for suffix in (".pdf", ".png"):
        plot(run, log.with_suffix(suffix))
    return replace(metrics(run), log=log.name)


def _write_numbers(done: list[RunMetrics], folder: Path) -> None:
    """Write both tables of the runs so far, so that they are whole after every run."""
    from pbrg_mj.analysis.metrics.paper_table import as_json, markdown
    from pbrg_mj.analysis.output_file import write_atomically

    write_atomically(folder / "numbers.md", _writing(markdown(done)))
    write_atomically(folder / "numbers.json", _writing(as_json(done)))


def _writing(text: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_text(text, encoding="utf-8")

    return write
