"""A log read for events, pictures and pages: of its largest columns a few numbers a tick, all of them for its end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.metrics.log_metrics import FinalColumns
from pbrg_mj.analysis.metrics.per_tick import PerTick, in_order
from pbrg_mj.log.read.column_store import Columns
from pbrg_mj.log.read.run import Run, TickSeries, open_run
from pbrg_mj.log.read.ticks import read_header

LEFT_OUT = {"multipliers", "half_space_binds", "velocity", "command", "wheel_speed", "body_pose", "hand", "p", "xi"}
HALF_SPACES = {"half_space_G", "half_space_h", "half_space_active"}


def open_reduced(path: str | Path, quantities: Sequence[PerTick] = (), *, half_spaces: bool = False) -> tuple[Run, Run]:
    """Return a log's run without the columns in LEFT_OUT, and its last seconds with all columns.

    `quantities` are taken from all columns, for `per_tick` to return. Timings are left out, and half-spaces unless they
    are asked for. Raises what `open_run` raises.
    """
    scenario = read_header(Path(path)).scenario
    each = {quantity.__name__: in_order(quantity, scenario) for quantity in quantities}
    end, without = FinalColumns(scenario), LEFT_OUT if half_spaces else LEFT_OUT | HALF_SPACES

    def of_ticks(block: Columns) -> Columns:
        end.add(block)
        ticks = TickSeries.of(block)
        with np.errstate(all="ignore"):  # as in the metrics
            taken = {name: quantity(ticks, scenario) for name, quantity in each.items()}
        return {name: values for name, values in block.items() if name not in without} | taken

    def of_optima(block: Columns) -> Columns:
        end.add_optima(block)
        return block

    run = open_run(path, {"Tick": of_ticks, "Optimum": of_optima, "Timing": lambda block: {}})
    return run, end.run(run)
