"""The paper's four runs: logs, figures and tables in one folder, the same files at every repetition."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from pbrg_mj.analysis.metrics.paper_table import RUNS, as_json, markdown
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.api.compare import Comparison
from pbrg_mj.api.files import check_paper_folder
from pbrg_mj.api.interrupt import Interrupted
from pbrg_mj.api.run import Run
from pbrg_mj.api.scenario import Scenario, load
from pbrg_mj.api.simulate import Sink, run
from pbrg_mj.errors import InputError

Watch = Callable[[Scenario], AbstractContextManager[Sink]]


def _no_sink(scenario: Scenario) -> AbstractContextManager[Sink]:
    return nullcontext(lambda record: None)


def reproduce(
    folder: str | Path, *, duration: float | None = None, force: bool = False, watch: Watch = _no_sink
) -> Comparison:
    """Make the paper's four runs and their figures (PDF and PNG), numbers.md and numbers.json in `folder`.

    `duration` [s] cuts every run short, `force` allows to replace logs that exist. `watch` is called with each scenario
    and gives a context manager, whose function sees that run's records.

    Ctrl-C raises Interrupted; the runs that are over are whole then. Raises InputError without matplotlib, or when a
    log exists.
    """
    folder = Path(folder)
    _prepare(folder, force=force)
    done: list[RunMetrics] = []
    for name in RUNS:
        scenario = load(f"paper/{name}", {"log.timings": False}, duration=duration)
        try:
            log, made = _simulate(scenario, folder / f"{name}.mcap", watch)
        except Interrupted as error:
            whole = ", ".join(RUNS[: len(done)]) or "nothing"
            raise Interrupted(f"whole in {folder}: {whole}", error.signal) from None
        done.append(_evaluate(log, made))
        _write_numbers(done, folder)
    return Comparison(tuple(done))


def _prepare(folder: Path, *, force: bool) -> None:
    if find_spec("matplotlib") is None:  # before the runs, which take longer
        raise InputError("figures need matplotlib: pip install matplotlib")
    check_paper_folder(folder, force=force)
    folder.mkdir(parents=True, exist_ok=True)


def _simulate(scenario: Scenario, path: Path, watch: Watch) -> tuple[Path, Run]:
    """Return log and run; when interrupted, nothing of the run is left."""
    part = path.with_name(f".{path.stem}-part.mcap")
    try:
        with watch(scenario) as sink:
            made = run(scenario, log=part, force=True, watch=[sink])
        return part.replace(path), made
    finally:
        part.unlink(missing_ok=True)


def _evaluate(log: Path, made: Run) -> RunMetrics:
    """Draw the run's figures beside its log and return its numbers."""
    for suffix in (".pdf", ".png"):
        made.figure(path=log.with_suffix(suffix))
    return replace(made.metrics, log=log.name)


def _write_numbers(done: list[RunMetrics], folder: Path) -> None:
    """Write both tables of the runs so far, so that they are whole after every run."""
    for name, text in (("numbers.md", markdown(done)), ("numbers.json", as_json(done))):
        write_text_atomically(folder / name, text)
