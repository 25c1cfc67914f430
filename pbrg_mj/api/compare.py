"""Runs side by side: the distributed answer against the centralized optimum, in one table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.metrics.paper_table import markdown
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.metrics.table import comparison_table
from pbrg_mj.api.logs import as_run, metrics_of
from pbrg_mj.api.plug_in_metrics import Metric
from pbrg_mj.api.run import FAILED, Run
from pbrg_mj.errors import InputError


@dataclass(frozen=True)
class Comparison:
    """The metrics of several runs, in the order they were given in."""

    metrics: tuple[RunMetrics, ...]
    own: tuple[dict[str, float | None], ...] = ()  # numbers of one's own metrics, if any were asked for

    def table(self) -> str:
        """Return the table as text, a column for each run."""
        return comparison_table(self.metrics, self.own)

    def markdown(self) -> str:
        """Return the table in Markdown, without wall-clock times."""
        return markdown(self.metrics)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return plain data for JSON, an object for each run: NaN and infinities are None."""
        whole = [one.as_dict() for one in self.metrics]
        return [one | {"own": own} for one, own in zip(whole, self.own, strict=True)] if self.own else whole

    @property
    def failed(self) -> bool:
        """Whether one of the runs was violated or diverged."""
        return any(one.outcome in FAILED for one in self.metrics)

    def __iter__(self) -> Iterator[RunMetrics]:
        """Iterate over the runs' metrics."""
        return iter(self.metrics)

    def __repr__(self) -> str:
        """Show the table."""
        return self.table()


def compare(*runs: Run | RunMetrics | str | Path, metrics: Sequence[Metric] = ()) -> Comparison:
    """Compare runs, or logs, or metrics of runs; `metrics` are of one's own, as `Run.metric` takes them.

    Raises InputError when a log cannot be read or a metric is unknown, PlugInError when a metric fails.
    """
    compared, own = [], []
    for one in runs:  # a log at a time: only the numbers are kept
        if isinstance(one, RunMetrics):
            if metrics:
                raise InputError("metrics of one's own are of runs or logs, not of their metrics")
            compared.append(one)
            continue
        if not metrics:
            compared.append(one.metrics if isinstance(one, Run) else metrics_of(one))
            continue
        run = as_run(one)
        compared.append(run.metrics)
        own.append({name: value for metric in metrics for name, value in run.metric(metric).items()})
    return Comparison(tuple(compared), tuple(own) if metrics else ())
