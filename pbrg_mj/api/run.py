"""A run: its arrays under the export's names, its numbers, figures, page and video."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from pbrg_mj.analysis.dataset import dataset
from pbrg_mj.analysis.export import RunArrays, export
from pbrg_mj.analysis.figures.figure import PAPER, plot, wanted_panels
from pbrg_mj.analysis.figures.panel import OnePart, draw_panel
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.analysis.metrics.table import short_summary
from pbrg_mj.analysis.output_file import by_suffix, write_atomically
from pbrg_mj.analysis.replay_summary import ReplaySummary, replay_summary
from pbrg_mj.analysis.report.page import check_page, write_page
from pbrg_mj.analysis.report.report_run import ReportRun, report_run
from pbrg_mj.analysis.series import series
from pbrg_mj.api.arrays import Arrays
from pbrg_mj.api.plug_in_metrics import Metric, evaluate_metric
from pbrg_mj.api.scenario import Scenario
from pbrg_mj.log.read.run import Run as Recorded
from pbrg_mj.log.write.log_file import check_writable
from pbrg_mj.scenario.load import LoadedScenario

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FAILED = {"violated", "diverged"}
IN_MEMORY = "in memory"


class Run:
    """A run, read from its log or kept in memory.

    Every array of the export is an attribute: `run.q_true_m` is (T, n, 2), time on the first axis. docs/export.md lists
    them; `run.arrays` holds them all.
    """

    def __init__(self, recorded: Recorded, content: bytes | None = None):
        """Take over a log that was read; `content` is the log itself where it is in no file."""
        self._recorded, self._content = recorded, content

    def __getattr__(self, name: str) -> np.ndarray:
        """Return the array of that name. Raises AttributeError."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.arrays, name)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the array of that name; `run["lambda"]` is none that Python takes as an attribute. Raises KeyError."""
        return self.arrays[name]

    def __dir__(self) -> list[str]:
        """List the arrays with the attributes, for completion."""
        return [*super().__dir__(), *self.arrays]

    def __repr__(self) -> str:
        """Name the run, its length and its outcome."""
        end = f"{self.metrics.duration_s:g} s, {self.metrics.outcome}"
        return f"<Run {self.scenario.name} ({self._recorded.path}): {end}>"

    @property
    def path(self) -> Path | None:
        """The log's file; None for a run that is kept in memory."""
        return Path(self._recorded.path) if self._content is None else None

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario as run; it can be run again."""
        one = self._recorded
        return Scenario(LoadedScenario(one.scenario, one.name, one.scenario_yaml))

    @property
    def versions(self) -> dict[str, str]:
        """Package name -> version of what made the log, with python and platform."""
        return self._recorded.versions

    @property
    def damage(self) -> str | None:
        """Why the log ends early, in one line; None for a complete log."""
        return self._recorded.damage

    @cached_property
    def arrays(self) -> Arrays:
        """All arrays by name, with the run's constants."""
        return Arrays(RunArrays(self._recorded))

    @cached_property
    def optimum(self) -> Arrays:
        """The centralized optimum, a row per reference tick: `time_s`, `m_star_m`, `cost_star_m2`, ..."""
        optima = self._recorded.optima
        solved = {one.key: one.values for one in series(self._recorded) if one.index is optima.index}
        return Arrays({"time_s": optima.time} | solved)

    @cached_property
    def metrics(self) -> RunMetrics:
        """The numbers of docs/metrics.md, units in the names: `run.metrics.terminal_gap_m`."""
        return metrics(self._recorded)

    def metric(self, metric: Metric, **options: Any) -> dict[str, float | None]:
        """Return the numbers of a metric of one's own: a function `metric(run)`, or the name of an installed one.

        Raises InputError for an unknown name and wrong options, PlugInError when the metric fails.
        """
        return evaluate_metric(self, metric, options)

    @property
    def failed(self) -> bool:
        """Whether the run was violated or diverged."""
        return self.metrics.outcome in FAILED

    def summary(self) -> str:
        """Return the lines that a run's end is evaluated by, as `pbrg run` prints them."""
        return short_summary(self.metrics)

    def replay(self) -> ReplaySummary:
        """Step through the run: what happened when, and how it ended; `lines()` is what `pbrg replay` prints."""
        return replay_summary(self._recorded)

    @overload
    def plot(self, panel: Literal["references"], ax: Axes | Sequence[Axes] | None = None) -> tuple[Axes, Axes]: ...
    @overload
    def plot(self, panel: OnePart = "trajectories", ax: Axes | None = None) -> Axes: ...
    def plot(self, panel: str = "trajectories", ax: Axes | Sequence[Axes] | None = None) -> Axes | tuple[Axes, Axes]:
        """Draw a panel into `ax`, or into axes of its own, and return the axes drawn into.

        The panel `references` has a part for x and one for y: it takes two axes or shares out one, and returns two.
        Raises InputError for an unknown panel, and when matplotlib is not installed.
        """
        drawn = draw_panel(self._recorded, panel, ax)
        return drawn if len(drawn) == 2 else drawn[0]

    def figure(self, panels: str | Sequence[str] = PAPER, path: str | Path | None = None) -> Figure:
        """Draw panels as one figure, by default the paper's two; write it to `path` (.pdf, .png, .svg) if one is given.

        Raises InputError for an unknown panel or suffix, and when matplotlib is not installed.
        """
        return plot(self._recorded, None if path is None else Path(path), wanted_panels(panels))

    def report(self, path: str | Path) -> Path:
        """Write one self-contained page (.html) and return its path. Raises InputError."""
        path = Path(path)
        check_page(path)
        write_page([self.as_report_run(1)], path)
        return path

    def as_report_run(self, runs: int) -> ReportRun:
        """Return what a page of so many runs shows of this one."""
        return report_run(self._recorded, runs)

    def render(self, path: str | Path, **options: Any) -> Path:
        """Write a video (.mp4, .webm, .gif, .webp) or a still (.png) of the run; return its path; options: `render`."""
        from pbrg_mj.api.video import render

        return render(self, path, **options)

    def view(self) -> None:
        """Show the run in MuJoCo's window until it is closed. Raises InputError without a display."""
        from pbrg_mj.video.viewer import view

        with self.file() as recorded:
            view(recorded)

    def export(self, path: str | Path) -> Path:
        """Write all arrays as .npz, .mat or .csv and return the path. Raises InputError."""
        export(self._recorded, Path(path))
        return Path(path)

    def to_xarray(self) -> xarray.Dataset:
        """Return all arrays as a dataset with named dimensions and units. Raises InputError without xarray."""
        return dataset(self._recorded)

    def save(self, path: str | Path, *, force: bool = False) -> Path:
        """Write the log (.mcap) of a run that is kept in memory, or copy it; return the path.

        `force` allows to replace a log that exists. Raises InputError when it may not, or the path cannot be written.
        """
        path = Path(path)
        by_suffix(path, {".mcap": None})
        check_writable(path, force=force)
        content = Path(self._recorded.path).read_bytes() if self._content is None else self._content

        def write(whole: Path) -> None:
            whole.write_bytes(content)

        write_atomically(path, write)
        return path

    @contextmanager
    def file(self) -> Iterator[Recorded]:
        """Give the run as recorded, with its log in a file for as long as the context lasts."""
        if self._content is None:
            yield self._recorded
            return
        with tempfile.TemporaryDirectory(prefix="pbrg-") as folder:
            path = Path(folder) / "run.mcap"
            path.write_bytes(self._content)
            yield replace(self._recorded, path=str(path))
