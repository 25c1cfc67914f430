"""Runs side by side: the distributed answer against the centralized optimum, in one table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.metrics.paper_table import markdown
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.metrics.table import comparison_table
from pbrg_mj.api.runs import FAILED, Run, as_run


@dataclass(frozen=True)
class Comparison:
    """The metrics of several runs, in the order they were given in."""

    metrics: tuple[RunMetrics, ...]

    def table(self) -> str:
        """Return the table as text, a column for each run."""
        return comparison_table(self.metrics)

    def markdown(self) -> str:
        """Return the table in Markdown, without wall-clock times."""
        return markdown(self.metrics)

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return plain data for JSON, an object for each run: NaN and infinities are None."""
        return [one.as_dict() for one in self.metrics]

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


def compare(*runs: Run | RunMetrics | str | Path) -> Comparison:
    """Compare runs, or logs, or metrics of runs. Raises InputError when a log cannot be read."""
    # A log at a time: only the numbers are kept.
    return Comparison(tuple(one if isinstance(one, RunMetrics) else as_run(one).metrics for one in runs))
