"""Logs read: as runs, or as numbers, figures, files and pages of logs that are never held as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pbrg_mj.analysis.export import WRITERS
from pbrg_mj.analysis.figures.figure import METADATA, check_panels, plot, wanted_panels
from pbrg_mj.analysis.metrics.log_metrics import log_metrics
from pbrg_mj.analysis.metrics.multiplier_rows import binding_area
from pbrg_mj.analysis.metrics.per_tick import certificate_rows, least_sensed_margin, multiplier_sums, state_size
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.output_file import by_suffix, check_place
from pbrg_mj.analysis.reduced_run import open_reduced
from pbrg_mj.analysis.replay_summary import ReplaySummary, replay_summary
from pbrg_mj.analysis.report.page import check_page, write_page
from pbrg_mj.analysis.report.report_run import ReportRun, report_log
from pbrg_mj.api.log_reading import read_log, warn_if_damaged
from pbrg_mj.api.run import Run


def open(log: str | Path) -> Run:  # noqa: A001 - pbrg.open
    """Read a log (.mcap). Of a damaged one, its leading whole part; a warning and `Run.damage` say why it ends.

    Raises InputError when there is no such file, or it is no log of this package.
    """
    return Run(read_log(log))


def as_run(run: Run | str | Path) -> Run:
    """Return the run itself, or the one in the log that is named."""
    return run if isinstance(run, Run) else open(run)


def metrics_of(log: str | Path) -> RunMetrics:
    """Return the metrics of a log, which is never held as a whole; damage is warned of, as by `open`."""
    found = log_metrics(log)
    warn_if_damaged(found.damage, log)
    return found


def export_log(log: str | Path, path: str | Path) -> None:
    """Write a log's arrays as .npz, .mat or .csv. Raises InputError."""
    by_suffix(Path(path), WRITERS)  # before the log is read, which takes longer
    check_place(Path(path))
    open(log).export(path)


def plot_log(log: str | Path, path: str | Path, panels: str) -> None:
    """Write a log's panels, names with commas between them or `all`, as .pdf, .png or .svg. Raises InputError."""
    by_suffix(Path(path), METADATA)  # likewise
    check_place(Path(path))
    wanted = wanted_panels(panels)
    check_panels(wanted)
    margins = (certificate_rows, least_sensed_margin) if "margin" in wanted else ()
    run, _ = open_reduced(log, (multiplier_sums, binding_area, *margins))
    warn_if_damaged(run.damage, log)
    plot(run, Path(path), wanted)


def replay_log(log: str | Path) -> ReplaySummary:
    """Step through a log, of which only what that needs is held. Raises InputError."""
    run, end = open_reduced(log, (state_size,))
    warn_if_damaged(run.damage, log)
    return replay_summary(run, end)


def report(runs: Sequence[Run | str | Path], path: str | Path) -> Path:
    """Write one self-contained page (.html) of runs, or logs, side by side; return its path. Raises InputError."""
    path = Path(path)
    check_page(path)  # before the logs are read, which takes longer
    # A log at a time: only what the page shows is kept.
    write_page([_on_page(run, len(runs)) for run in runs], path)
    return path


def _on_page(run: Run | str | Path, runs: int) -> ReportRun:
    if isinstance(run, Run):
        return run.as_report_run(runs)
    shown = report_log(run, runs)
    warn_if_damaged(shown.numbers.damage, run)
    return shown
