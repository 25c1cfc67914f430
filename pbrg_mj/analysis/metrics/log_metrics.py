"""The metrics of a log, of which only what they need is kept while it is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.metrics.binding import SECOND
from pbrg_mj.analysis.metrics.margins import sensed_series
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, leaders_of, metrics
from pbrg_mj.log.read import run as reader
from pbrg_mj.log.read.columns import Columns
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.scenario.schema import Scenario

# Columns of a tick that no metric needs, and those that are large and whose metrics are taken block by block.
UNUSED = {
    *("wheel_speed", "body_pose", "hand", "pose_frame", "scan_frame", "velocity", "command", "lost", "multipliers"),
    *("storage", "storage_change", "worst_row", "stationarity", "complementarity"),
    *("flow_primal_storage", "flow_dual_storage", "flow_primal_dissipation", "flow_dual_dissipation"),
}
REDUCED = {"half_space_G", "half_space_h", "half_space_active", "half_space_binds"}


def log_metrics(path: str | Path) -> RunMetrics:
    """Return `metrics(open_run(path))`, number by number, in a fraction of the memory. Raises what that raises."""
    scenario = read_header(Path(path)).scenario
    formation, leaders, end = np.array(scenario.team.formation), leaders_of(scenario), _End(scenario)

    def reduce(columns: Columns) -> Columns:
        end.add(columns)
        sensed = sensed_series(TickSeries.of(columns), formation, leaders)
        return {name: values for name, values in columns.items() if name not in UNUSED | REDUCED} | sensed

    run = reader.open_run(path, reduce)
    return metrics(run, replace(run, ticks=end.ticks(), reduced={}))


class _End:
    """All columns of the last ticks: as many as what binds at the end is told by."""

    def __init__(self, scenario: Scenario):
        self._ticks = 2 + int((scenario.outcome.rest_time + SECOND) / scenario.timing.tick)
        self._blocks: list[Columns] = []

    def add(self, block: Columns) -> None:
        """Take the next block, and forget what is no longer the end."""
        self._blocks.append(block)
        held = sum(len(one["time"]) for one in self._blocks)
        while held - len(self._blocks[0]["time"]) >= self._ticks:
            held -= len(self._blocks.pop(0)["time"])

    def ticks(self) -> TickSeries:
        """Return them."""
        return TickSeries.of({name: np.concatenate([one[name] for one in self._blocks]) for name in self._blocks[0]})
