"""The paper's four runs side by side: a table of numbers that is the same at every repetition."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence

from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.analysis.metrics.table import LAYOUT, WRAPPED, cell, shown, text
from pbrg_mj.scenario.bundled import PAPER_RUNS
from pbrg_mj.text import markdown_code, markdown_text

RUNS = PAPER_RUNS
"""The bundled scenarios under `paper/`, in the order of the paper's figures 4, 5, 7 and 8."""

LEFT_OUT = {"wall clock"}  # groups of numbers that differ from one repetition to the next


def markdown(runs: Sequence[RunMetrics]) -> str:
    """Return the runs' numbers as a Markdown table, a column each: the rows of `pbrg compare` but wall-clock times."""
    data = [run.as_dict() for run in runs]
    lines = [_row("", [markdown_code(one["scenario"]) for one in data]), _row("---", ["---"] * len(data))]
    lines += [
        _row(label, [markdown_text((text if key in WRAPPED else cell)(shown(one, key))) for one in data])
        for label, key in _rows()
    ]
    return "\n".join(lines) + "\n"


def as_json(runs: Sequence[RunMetrics]) -> str:
    """Return what `pbrg compare --json` prints of the runs."""
    return json.dumps([run.as_dict() for run in runs], indent=2, allow_nan=False) + "\n"


def _rows() -> Iterator[tuple[str, str]]:
    for group, rows in LAYOUT.items():
        if group not in LEFT_OUT:
            yield from ((label.strip(), key) for label, key in rows if key != "scenario")


def _row(label: str, cells: list[str]) -> str:
    return "| " + " | ".join(one.replace("|", "\\|") for one in [label, *cells]) + " |"
