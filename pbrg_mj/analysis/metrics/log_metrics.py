"""The metrics of a log that is read once, a block at a time, and never held."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.metrics.binding import ticks_needed
from pbrg_mj.analysis.metrics.index_join import MissingRowError
from pbrg_mj.analysis.metrics.outcome import first_violation_rows
from pbrg_mj.analysis.metrics.per_tick import state_size
from pbrg_mj.analysis.metrics.run_metrics import MetricTotals, RunMetrics, metrics_from_totals
from pbrg_mj.log.read import run as reader
from pbrg_mj.log.read.column_store import Columns
from pbrg_mj.log.read.columns import Reduce
from pbrg_mj.log.read.run import OptimumSeries, Run, TickSeries, TimingSeries
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.scenario.schema import Scenario, whole_number

OUTCOME_COLUMNS = (  # the columns that decide the outcome
    *("index", "time", "status", "reference", "m", "hand_true", "body_pose_true", "wall_margin", "moving_margin"),
    *("wall_contact", "moving_contact", "robot_contact"),
)


def log_metrics(path: str | Path) -> RunMetrics:
    """Return `metrics(open_run(path))`, number by number but for the rounding of means. Raises what that raises."""
    scenario = read_header(Path(path)).scenario
    try:
        return _read(path, scenario, _reference_every(scenario))
    except MissingRowError:  # optima elsewhere than the scenario has them
        return _read(path, scenario, 1)


def _read(path: str | Path, scenario: Scenario, every: int) -> RunMetrics:
    blocks = MetricsOfBlocks(scenario, every)
    return blocks.metrics(reader.open_run(path, blocks.reduce))


class MetricsOfBlocks:
    """Metrics of columns that come a block at a time, ticks before the optima and timings that belong to them."""

    def __init__(self, scenario: Scenario, every: int | None = None):
        """Optima are looked for at every `every`-th tick alone, at none for 0; None: where the scenario has them."""
        every = _reference_every(scenario) if every is None else every
        self._totals = MetricTotals(scenario, every)
        self._reduced, self._end = OutcomeColumns(scenario), FinalColumns(scenario)

    @property
    def reduce(self) -> dict[str, Reduce]:
        """What to do with each block of columns, by the message's name."""
        # Not held: methods in an attribute would keep each other, and a study's runs would wait for Python's collector.
        return {"Tick": self._of_ticks, "Optimum": self._of_optima, "Timing": self._of_timings}

    def metrics(self, run: Run) -> RunMetrics:
        """Return the metrics of a run, whose columns are those that came."""
        return metrics_from_totals(self._totals, self._reduced.run(run), self._end.run(run))

    def _of_ticks(self, block: Columns) -> Columns:
        self._totals.add_ticks(block)
        self._reduced.add(block)
        self._end.add(block)
        return {}

    def _of_optima(self, block: Columns) -> Columns:
        self._totals.add_optima(block)
        self._end.add_optima(block)
        return {}

    def _of_timings(self, block: Columns) -> Columns:
        self._totals.add_timings(block)
        return {}


def _reference_every(scenario: Scenario) -> int:
    """Return from how many ticks to how many there is an optimum; 0 for none."""
    every = whole_number(scenario.reference.period, scenario.timing.tick)
    return 0 if scenario.reference.solver == "none" else every


class LastTicks:
    """Columns of the last ticks."""

    def __init__(self, ticks: int):
        self._ticks = ticks
        self.blocks: list[Columns] = []

    def add(self, block: Columns) -> None:
        """Take the next block, and forget what is no longer the end."""
        self.blocks.append(block)
        held = sum(len(one["index"]) for one in self.blocks)
        while held - len(self.blocks[0]["index"]) >= self._ticks:
            held -= len(self.blocks.pop(0)["index"])


class FinalColumns:
    """All columns of the last ticks, and of the last optimum: `bindings` needs no more."""

    def __init__(self, scenario: Scenario):
        self._last = LastTicks(ticks_needed(scenario))
        self._optimum: Columns = {}

    def add(self, block: Columns) -> None:
        """Take the next ticks."""
        self._last.add(block)

    def add_optima(self, block: Columns) -> None:
        """Take the next optima."""
        if len(block["index"]) or not self._optimum:
            self._optimum = {name: values[-1:].copy() for name, values in block.items()}

    def run(self, run: Run) -> Run:
        """Return the run with these alone."""
        ticks = TickSeries.of(concatenate_columns(self._last.blocks))
        return replace(run, ticks=ticks, optima=OptimumSeries.of(self._optimum))


class OutcomeColumns:
    """The ticks that decide the outcome: the first one, first violations, r's last change, the last seconds."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        seconds = scenario.outcome.rest_time + min(scenario.outcome.trend_time, scenario.timing.duration)
        self._last = LastTicks(3 + int(seconds / scenario.timing.tick))
        self._kept: dict[str, Columns] = {}

    def add(self, block: Columns) -> None:
        """Take the next ticks."""
        if not len(block["index"]):
            return
        with np.errstate(all="ignore"):  # as in the metrics
            size = state_size(TickSeries.of(block), self._scenario)
        reduced = {name: block[name] for name in OUTCOME_COLUMNS} | {state_size.__name__: size}
        self._kept.setdefault("first", _rows(reduced, 0, 1))
        for name, row in first_violation_rows(_part(self._scenario, reduced)):
            self._kept.setdefault(name, _rows(reduced, row, row + 1))
        before = [self._last.blocks[-1]] if self._last.blocks else []
        r = np.concatenate([*(one["reference"][-1:] for one in before), reduced["reference"]])
        changes = np.flatnonzero(np.any(np.diff(r, axis=0) != 0, axis=1)) + 1 - len(before)
        if len(changes):
            row = int(changes[-1])
            self._kept["before"] = _rows(reduced, row - 1, row) if row else _rows(before[0], -1, None)
            self._kept["change"] = _rows(reduced, row, row + 1)
        self._last.add(reduced)

    def run(self, run: Run) -> Run:
        """Return the run with these ticks alone."""
        columns = concatenate_columns([*self._kept.values(), *self._last.blocks])
        rows = np.unique(columns["index"], return_index=True)[1]
        columns = {name: values[rows] for name, values in columns.items()}
        reduced = {state_size.__name__: columns.pop(state_size.__name__)}
        return replace(run, ticks=TickSeries.of(columns), reduced=reduced)


def _part(scenario: Scenario, reduced: Columns) -> Run:
    """Return ticks as a run that has nothing else."""
    none: Columns = {}
    return Run(
        path="",
        name="",
        scenario=scenario,
        scenario_yaml="",
        model_xml="",
        versions={},
        ticks=TickSeries.of(reduced),
        optima=OptimumSeries.of(none),
        timings=TimingSeries.of(none),
        damage=None,
        reduced={state_size.__name__: reduced[state_size.__name__]},
    )


def concatenate_columns(blocks: list[Columns]) -> Columns:
    """Return columns one behind the other."""
    return {name: np.concatenate([one[name] for one in blocks]) for name in blocks[0]}


def _rows(columns: Columns, first: int, last: int | None) -> Columns:
    return {name: values[first:last].copy() for name, values in columns.items()}
