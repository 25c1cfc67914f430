"""The table in words: cells, plain text for a terminal, and Markdown with links to logs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.studies.bench.statistics import Difference, Quartiles
from pbrg_mj.studies.bench.suite import Suite
from pbrg_mj.studies.bench.table import CERTIFICATES, BenchRun, Row
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted, format_significant

NONE = "-"
SETTLING = "settling_time_including_violated_s"  # without governor robots touch each other, and settle all the same
NAMES = {"held_out": "held-out seeds", "train": "train seeds"}


def _rate(rate: Rate | None) -> str:
    return f"{100 * rate.share:.0f} % [{100 * rate.low:.0f}, {100 * rate.high:.0f}]" if rate else NONE


def quartiles_text(one: Quartiles | None) -> str:
    """Return median and quartiles in words, `NONE` where there are none."""
    if one is None:
        return NONE
    median, low, high = (format_significant(value, 3) for value in (one.median, one.low, one.high))
    return f"{median} [{low}, {high}]"


def _number(value: float | None) -> str:
    return NONE if value is None else format_significant(value, 3)


def _difference(one: Difference | None) -> str:
    if one is None:
        return NONE
    mean, low, high = (format_significant(value, 3, "+") for value in (one.mean, one.low, one.high))
    return f"{mean} [{low}, {high}]"


def _least(row: Row) -> str:
    worst = row.by_margin()
    return _number(worst[0].number("true_margin_min_m")) if worst else NONE


def _settling(row: Row) -> str:
    ratios = Quartiles.of(row.ratios(SETTLING))
    settled = f"{len(row.values(SETTLING))} of {len(row.ok)}"
    return f"{format_significant(ratios.median, 3)} ({settled})" if ratios else f"{NONE} ({settled})"


def _bytes(row: Row) -> str:
    return "centralized" if row.centralized else _number(row.mean("sent_per_robot_per_tick_bytes"))


def _messages(row: Row) -> str:
    return "centralized" if row.centralized else _number(row.messages)


def _shares(row: Row) -> str:
    shares = [row.mean(name) for name in CERTIFICATES]
    return " / ".join(NONE if share is None else f"{100 * share:.1f}" for share in shares)


COLUMNS: dict[str, Callable[[Row], str]] = {
    "governor": lambda row: row.governor + (" (centralized)" if row.centralized else ""),
    "network": lambda row: row.network,
    "runs": lambda row: (
        f"{len(row.runs)}" + (f", {len(row.runs) - len(row.ok)} failed" if len(row.ok) < len(row.runs) else "")
    ),
    "contacts [95 %]": lambda row: _rate(row.rate(lambda one: one.touched)),
    "crossings [95 %]": lambda row: _rate(row.rate(lambda one: one.crossed)),
    "least margin [m]": _least,
    "gap to the optimum [m]": lambda row: quartiles_text(row.quartiles("optimality_gap_m.mean")),
    "its geometric mean [m]": lambda row: _number(row.gap),
    "gap against none [m]": lambda row: _difference(row.difference("optimality_gap_m.mean")),
    "distance left [m]": lambda row: quartiles_text(row.quartiles("terminal_gap_m")),
    "settling / none (settled)": _settling,
    "violated: ball / directional / predictive [%]": _shares,
    "infeasible [s]": lambda row: _number(row.infeasible),
    "rounds": lambda row: _number(row.mean("rounds_per_tick")),
    "messages": _messages,
    "bytes": _bytes,
}


def cells(row: Row) -> list[str]:
    """Return a row's cells."""
    return [cell(row) for cell in COLUMNS.values()]


def as_text(rows: Sequence[Row]) -> str:
    """Return the table for a terminal, turned: a column a governor, so that it fits."""
    parts = []
    for group, title in NAMES.items():
        for network in dict.fromkeys(row.network for row in rows):
            shown = [row for row in rows if (row.group, row.network) == (group, network)]
            columns = [
                [f"{title}, {network}", *list(COLUMNS)[2:]],
                *([row_cells[0], *row_cells[2:]] for row_cells in map(cells, shown)),
            ]
            widths = [max(map(len, column)) for column in columns]
            lines = zip(*columns, strict=True)
            parts.append("\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines))
    return "\n\n".join(parts)


def as_markdown(suite: Suite, rows: Sequence[Row]) -> str:
    """Return the table in Markdown, the same at every repetition; margins lead to the logs that made them."""
    parts = [f"{suite.title}: {counted(len(suite.tasks), 'run')}.\n"]
    for group, title in NAMES.items():
        lines = [_line(list(COLUMNS)), "|" + "---|" * len(COLUMNS)]
        lines += [
            _line([_linked(row, name, cell) for name, cell in zip(COLUMNS, cells(row), strict=True)])
            for row in rows
            if row.group == group
        ]
        parts.append(f"## {title.capitalize()}\n\n" + "\n".join(lines) + "\n")
    tunings = "\n".join(f"- {name}: {tuning}" for name, tuning in suite.tunings.items())
    return "\n".join([*parts, f"## Tunings\n\n{tunings}\n"])


def runs_markdown(runs: Sequence[BenchRun]) -> str:
    """Return all runs with their logs and the commands that make them."""
    head = ["log", "outcome", "least margin [m]", "gap to the optimum [m]", "command"]
    lines = [_line(head), "|" + "---|" * len(head)]
    for one in runs:
        ended = str(one.record["outcome"]) if one.ok else f"failed: {one.record['error']}"
        numbers = [_number(one.number(name)) for name in ("true_margin_min_m", "optimality_gap_m.mean")]
        log = f"[{one.log}]({LOGS}/{one.log})" if one.ok else one.log
        lines.append(_line([log, ended, *numbers, f"`{one.task.command(one.log)}`"]))
    return "\n".join(lines) + "\n"


def _linked(row: Row, name: str, cell: str) -> str:
    """Return a cell; the least margin with a link to the log that has it."""
    if name != "least margin [m]" or not (ordered := row.by_margin()):
        return cell
    return f"[{cell}]({LOGS}/{ordered[0].log})"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
