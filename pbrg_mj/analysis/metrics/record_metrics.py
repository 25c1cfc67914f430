"""The metrics of a run from its ticks as they come, without a log: those of its log, number by number."""

from __future__ import annotations

from collections.abc import Callable

from pbrg_mj.analysis.metrics.log_metrics import MetricsOfBlocks
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.log.read.columns import MessageColumns
from pbrg_mj.log.read.run import OptimumSeries, Run, TickSeries, TimingSeries
from pbrg_mj.log.schema.ending import Ending
from pbrg_mj.log.schema.protobuf import encoder
from pbrg_mj.log.write.messages import dims_of
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.schema import Scenario


class RecordMetrics:
    """A sink: call it with every TickRecord, in order.

    Ticks pass through the messages that a log has of them, so that there is one way from a tick to the columns that are
    evaluated. Pictures, scans, compression and the file are left out.
    """

    def __init__(self, scenario: Scenario, name: str, *, centralized: bool):
        """`name` is the scenario's; `centralized` says whether the governor sees the whole team."""
        self._scenario, self._name, self._centralized = scenario, name, centralized
        self._blocks = MetricsOfBlocks(scenario)
        self._columns: dict[str, MessageColumns] = {}
        self._encode: dict[str, Callable[[TickRecord], bytes]] = {}

    def __call__(self, record: TickRecord) -> None:
        """Take one record."""
        if not self._columns:
            self._start(record)
        for name, encode in self._encode.items():
            if name != "Optimum" or record.optimum is not None:
                self._columns[name].add(encode(record), record.index, record.index)

    def metrics(self) -> RunMetrics:
        """Return the metrics of all records, one or more; none may follow."""
        for columns in self._columns.values():
            columns.columns()
        run = Run(
            path="",
            name=self._name,
            scenario=self._scenario,
            scenario_yaml="",
            model_xml="",
            versions={},
            ticks=TickSeries.of({}),
            optima=OptimumSeries.of({}),
            timings=TimingSeries.of({}),
            damage=None,
            ending=Ending.of(None, self._columns["Tick"].count, self._scenario),
            centralized=self._centralized,
        )
        return self._blocks.metrics(run)

    def _start(self, first: TickRecord) -> None:
        dims = dims_of(first)
        for name, reduce in self._blocks.reduce.items():
            self._columns[name] = MessageColumns(name, dims, reduce)
            if name != "Timing" or self._scenario.log.timings:
                self._encode[name] = encoder(name, dims)
