"""The table for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from pbrg_mj.studies.bench.columns import (
    COLUMNS,
    DIFFERENCES,
    DIFFERENCES_TITLE,
    NAMED,
    NAMES,
    WALL_CLOCK,
    WALL_CLOCK_TITLE,
    Columns,
    cells,
    compared,
)
from pbrg_mj.studies.bench.table import Row


def as_text(rows: Sequence[Row]) -> str:
    """Return the table for a terminal, turned: a column a governor, so that it fits."""
    parts = []
    for group, name in NAMES.items():
        for network in dict.fromkeys(row.network for row in rows):
            title, shown = f"{name}, {network}", [row for row in rows if (row.group, row.network) == (group, network)]
            parts.append(_turned(title, COLUMNS, shown))
            if pairs := compared(shown):
                parts.append(f"{DIFFERENCES_TITLE}\n{_turned(title, DIFFERENCES, pairs)}")
    return "\n\n".join(parts)


def wall_clock_text(rows: Sequence[Row]) -> str:
    """Return the times by the wall clock for a terminal, a line a row."""
    return f"{WALL_CLOCK_TITLE}\n{_aligned([list(WALL_CLOCK), *(cells(row, WALL_CLOCK) for row in rows)])}"


def _turned(title: str, columns: Columns, rows: Sequence[Row]) -> str:
    """Return rows as columns, each under its governor's name."""
    turned = [[title, *list(columns)[NAMED:]]]
    turned += [[one[0], *one[NAMED:]] for one in (cells(row, columns) for row in rows)]
    return _aligned(list(zip(*turned, strict=True)))


def _aligned(lines: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)
