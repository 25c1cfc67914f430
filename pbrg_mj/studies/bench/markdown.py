"""The table and its runs in Markdown, with links to logs."""

from __future__ import annotations

from collections.abc import Sequence

from pbrg_mj.studies.bench.columns import (
    COLUMNS,
    DIFFERENCES,
    DIFFERENCES_TITLE,
    GAP,
    MARGIN,
    NAMES,
    Columns,
    compared,
    number_text,
)
from pbrg_mj.studies.bench.suite import Suite
from pbrg_mj.studies.bench.table import BenchRun, Row
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted


def as_markdown(suite: Suite, rows: Sequence[Row]) -> str:
    """Return the table in Markdown, the same at every repetition; margins lead to the logs that made them."""
    parts = [f"{suite.title}: {counted(len(suite.tasks), 'run')}.\n"]
    for group, title in NAMES.items():
        shown = [row for row in rows if row.group == group]
        parts.append(f"## {title.capitalize()}\n\n{_table(COLUMNS, shown)}")
        if pairs := compared(shown):
            parts.append(f"{title.capitalize()}: {DIFFERENCES_TITLE}\n\n{_table(DIFFERENCES, pairs)}")
    tunings = "\n".join(f"- {name}: {tuning}" for name, tuning in suite.tunings.items())
    return "\n".join([*parts, f"## Tunings\n\n{tunings}\n"])


def runs_markdown(runs: Sequence[BenchRun]) -> str:
    """Return all runs with their logs and the commands that make them."""
    head = ["log", "outcome", "least margin [m]", "gap to the optimum [m]", "command"]
    lines = [*_head(head)]
    for one in runs:
        ended = str(one.record["outcome"]) if one.ok else f"failed: {one.record['error']}"
        numbers = [number_text(one.number(name)) for name in (MARGIN, GAP)]
        log = f"[{one.log}]({LOGS}/{one.log})" if one.ok else one.log
        lines.append(_line([log, ended, *numbers, f"`{one.task.command(one.log)}`"]))
    return "\n".join(lines) + "\n"


def _table(columns: Columns, rows: Sequence[Row]) -> str:
    lines = [_line([_linked(row, columns, name) for name in columns]) for row in rows]
    return "\n".join([*_head(list(columns)), *lines]) + "\n"


def _linked(row: Row, columns: Columns, name: str) -> str:
    """Return a cell; the least margin of all runs with a link to the log that has it."""
    cell = columns[name](row)
    if columns is not COLUMNS or name != "least margin [m]" or not (ordered := row.by_margin()):
        return cell
    return f"[{cell}]({LOGS}/{ordered[0].log})"


def _head(names: Sequence[str]) -> tuple[str, str]:
    return _line(names), "|" + "---|" * len(names)


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
