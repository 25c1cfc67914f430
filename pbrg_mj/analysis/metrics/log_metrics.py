"""The metrics of a log, of which only what they need is kept while it is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics import per_tick
from pbrg_mj.analysis.metrics.binding import SECOND
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.log.read import run as reader
from pbrg_mj.log.read.columns import Columns
from pbrg_mj.log.read.run import OptimumSeries, TickSeries
from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.scenario.schema import Scenario, whole_number

KEPT = {
    *("index", "time", "hand_true", "wall_margin", "moving_margin", "wall_contact", "moving_contact", "robot_contact"),
    *("reference", "status", "rounds", "consensus_spread", "winding_up"),
}
AT_REFERENCE = ("p", "xi", "m")  # kept of the ticks at which there may be an optimum
NOT_OF_OPTIMA = ("multipliers", "primal_storage", "dual_storage", "primal_dissipation", "dual_dissipation")


class NotKeptError(LookupError):
    """A row of a column that was not kept."""


class KeptRows:
    """A column of which only some rows are there."""

    def __init__(self, rows: np.ndarray, values: np.ndarray):
        self._rows, self._values = rows, values

    def __getitem__(self, rows: Any) -> np.ndarray:
        """Return the values of those rows, a number or an array of numbers. Raises NotKeptError."""
        places = np.minimum(np.searchsorted(self._rows, rows), max(len(self._rows) - 1, 0))
        if not len(self._rows) or np.any(self._rows[places] != rows):
            raise NotKeptError
        return self._values[places]


def log_metrics(path: str | Path) -> RunMetrics:
    """Return `metrics(open_run(path))`, number by number, in a fraction of the memory. Raises what that raises."""
    kept = _Kept(read_header(Path(path)).scenario)
    run = reader.open_run(path, {"Tick": kept.of_ticks, "Optimum": kept.of_optima})
    end = replace(run, ticks=kept.end.series(), optima=kept.last_optimum(), reduced={})
    try:
        return metrics(replace(run, ticks=TickSeries.of(vars(run.ticks) | kept.rows())), end)
    except NotKeptError:  # optima elsewhere than the scenario has them
        return metrics(reader.open_run(path))


class _Kept:
    """What is kept of a log's blocks, besides the columns that are kept as they are."""

    def __init__(self, scenario: Scenario):
        self._scenario = scenario
        self._every = whole_number(scenario.reference.period, scenario.timing.tick)
        self._at_reference: list[tuple[np.ndarray, Columns]] = []  # ticks, and their rows
        self._in_contact: tuple[np.ndarray, np.ndarray] | None = None  # the first tick with robots in contact
        self._last_optimum: Columns = {}
        self.end = _End(2 + int((scenario.outcome.rest_time + SECOND) / scenario.timing.tick))

    def of_ticks(self, block: Columns) -> Columns:
        """Return what is kept of a block of ticks."""
        self.end.add(block)
        chosen = np.flatnonzero(block["index"] % self._every == 0)
        self._at_reference.append((block["index"][chosen], {name: block[name][chosen] for name in AT_REFERENCE}))
        touching = np.flatnonzero(block["robot_contact"].any(axis=1))[:1]
        if len(touching) and self._in_contact is None:
            self._in_contact = block["index"][touching], block["body_pose_true"][touching]
        ticks = TickSeries.of(block)
        with np.errstate(all="ignore"):  # as in the metrics
            taken = {quantity.__name__: quantity(ticks, self._scenario) for quantity in per_tick.ALL}
        return {name: block[name] for name in KEPT} | taken

    def of_optima(self, block: Columns) -> Columns:
        """Return what is kept of a block of optima."""
        self._last_optimum = {name: values[-1:].copy() for name, values in block.items()}
        return {name: values for name, values in block.items() if name not in NOT_OF_OPTIMA}

    def last_optimum(self) -> OptimumSeries:
        """Return the last one alone, with all columns; of none, empty columns."""
        return OptimumSeries.of(self._last_optimum)

    def rows(self) -> dict[str, Any]:
        """Return the columns of which some rows are kept."""
        rows = np.concatenate([rows for rows, _ in self._at_reference])
        found = {
            name: KeptRows(rows, np.concatenate([values[name] for _, values in self._at_reference]))
            for name in AT_REFERENCE
        }
        nowhere = np.zeros(0, dtype=np.int64), np.zeros((0, self._scenario.robots, 3))
        return found | {"body_pose_true": KeptRows(*(self._in_contact or nowhere))}


class _End:
    """All columns of the last ticks."""

    def __init__(self, ticks: int):
        self._ticks = ticks
        self._blocks: list[Columns] = []

    def add(self, block: Columns) -> None:
        """Take the next block, and forget what is no longer the end."""
        self._blocks.append(block)
        held = sum(len(one["time"]) for one in self._blocks)
        while held - len(self._blocks[0]["time"]) >= self._ticks:
            held -= len(self._blocks.pop(0)["time"])

    def series(self) -> TickSeries:
        """Return them."""
        return TickSeries.of({name: np.concatenate([one[name] for one in self._blocks]) for name in self._blocks[0]})
