"""The table and its runs in Markdown, with links to logs."""

from __future__ import annotations

from collections.abc import Sequence

from pbrg_mj.studies.bench.columns import (
    COLUMNS,
    DIFFERENCES,
    DIFFERENCES_TITLE,
    NAMES,
    NONE,
    RUN_COLUMNS,
    WALL_CLOCK,
    WALL_CLOCK_TITLE,
    Columns,
    compared,
    link,
    run_cells,
    title,
)
from pbrg_mj.studies.bench.suite import Suite
from pbrg_mj.studies.bench.table import BenchRun, Row
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted, markdown_code, markdown_text

RUNS = "runs.md"
FROM_FILES = ("governor", "network")  # columns whose text is the suite's


def as_markdown(suite: Suite, rows: Sequence[Row]) -> str:
    """Return the table in Markdown, the same at every repetition.

    The least margin leads to the log that has it, each governor to `runs.md`, which has the logs of its row.
    """
    parts = [f"{markdown_text(suite.title)}: {counted(len(suite.tasks), 'run')}.\n"]
    for group, name in NAMES.items():
        shown = [row for row in rows if row.group == group]
        parts.append(f"## {name.capitalize()}\n\n{_table(COLUMNS, shown)}")
        if pairs := compared(shown):
            parts.append(f"{name.capitalize()}: {DIFFERENCES_TITLE}\n\n{_table(DIFFERENCES, pairs)}")
    tunings = "\n".join(f"- {markdown_text(f'{governor}: {tuning}')}" for governor, tuning in suite.tunings.items())
    return "\n".join([*parts, f"## Tunings\n\n{tunings}\n"])


def wall_clock_markdown(rows: Sequence[Row]) -> str:
    """Return the times by the wall clock in Markdown: other ones at every repetition."""
    return f"{WALL_CLOCK_TITLE}\n\n{_table(WALL_CLOCK, rows)}"


def runs_markdown(rows: Sequence[Row]) -> str:
    """Return the runs of each row: logs, what the table has of them, and the commands that make the logs."""
    return "\n".join(f'## <a id="{row.anchor}"></a>{markdown_text(title(row))}\n\n{_runs(row)}' for row in rows)


def _runs(row: Row) -> str:
    others = row.others()
    head = ["log", "ended", *RUN_COLUMNS, "compared with", "command"]
    return "\n".join([*_head(head), *(_run(one, others.get(one.log)) for one in row.runs)]) + "\n"


def _run(one: BenchRun, other: BenchRun | None) -> str:
    ended, *cells = run_cells(one)
    return _line([_log(one), markdown_text(ended), *cells, _log(other), markdown_code(one.task.command(one.log))])


def _log(one: BenchRun | None) -> str:
    if one is None:
        return NONE
    return f"[{one.log}]({LOGS}/{one.log})" if one.ok else one.log


def _table(columns: Columns, rows: Sequence[Row]) -> str:
    lines = [_line([_linked(row, columns, column) for column in columns]) for row in rows]
    return "\n".join([*_head(list(columns)), *lines]) + "\n"


def _linked(row: Row, columns: Columns, column: str) -> str:
    """Return a cell; the governor with a link to its runs, the least margin of all with one to the log that has it."""
    cell, place = columns[column](row), link(row, columns, column, RUNS)
    cell = markdown_text(cell) if column in FROM_FILES else cell
    return f"[{cell}]({place})" if place else cell


def _head(names: Sequence[str]) -> tuple[str, str]:
    return _line(names), "|" + "---|" * len(names)


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
