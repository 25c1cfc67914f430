"""What the columns of the tables hold, in words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.studies.bench.statistics import Difference, Quartiles
from pbrg_mj.studies.bench.table import CERTIFICATES, WITHOUT, BenchRun, Row
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import format_significant

NONE = "-"
MARGIN, GAP, LEFT = "true_margin_min_m", "optimality_gap_m.mean", "terminal_gap_m"
SETTLING = "settling_time_including_violated_s"  # without governor robots touch each other, and settle all the same
NAMES = {"held_out": "held-out seeds", "train": "train seeds"}


def title(row: Row) -> str:
    """Return what stands above a row's runs."""
    return f"{name(row)}, {row.network}, {NAMES[row.group]}"


def name(row: Row) -> str:
    """Return the governor's name, and whether it sees the whole team."""
    return row.governor + (" (centralized)" if row.centralized else "")


def _rate(rate: Rate | None) -> str:
    return f"{100 * rate.share:.0f} % [{100 * rate.low:.0f}, {100 * rate.high:.0f}]" if rate else NONE


def quartiles_text(one: Quartiles | None) -> str:
    """Return median and quartiles in words, `NONE` where there are none."""
    if one is None:
        return NONE
    median, low, high = (format_significant(value, 3) for value in (one.median, one.low, one.high))
    return f"{median} [{low}, {high}]"


def number_text(value: float | None) -> str:
    """Return a number in words, `NONE` where there is none."""
    return NONE if value is None else format_significant(value, 3)


def _difference(one: Difference | None) -> str:
    if one is None:
        return NONE
    mean, low, high = (format_significant(value, 3, "+") for value in (one.mean, one.low, one.high))
    return f"{mean} [{low}, {high}] ({one.pairs})"


def _of_some(row: Row, metric: str) -> str:
    """Return a metric's quartiles, and how many runs have it where not all do."""
    known = len(row.values(metric))
    text = quartiles_text(row.quartiles(metric))
    return text if known in (0, len(row.ok)) else f"{text} ({known} of {len(row.ok)})"


def _least(row: Row) -> str:
    worst = row.by_margin()
    return number_text(worst[0].number(MARGIN)) if worst else NONE


def _settling(row: Row) -> str:
    ratios = Quartiles.of(row.ratios(SETTLING))
    settled = f"{len(row.values(SETTLING))} of {len(row.ok)}"
    return f"{format_significant(ratios.median, 3)} ({settled})" if ratios else f"{NONE} ({settled})"


def _yes(happened: bool) -> str:
    return "yes" if happened else "no"


def _bytes(row: Row) -> str:
    return "centralized" if row.centralized else number_text(row.mean("sent_per_robot_per_tick_bytes"))


def _messages(row: Row) -> str:
    return "centralized" if row.centralized else number_text(row.messages)


def _shares(row: Row) -> str:
    return _shares_text([row.mean(name) for name in CERTIFICATES])


def _shares_text(shares: Sequence[float | None]) -> str:
    return " / ".join(NONE if share is None else f"{100 * share:.1f}" for share in shares)


Columns = Mapping[str, Callable[[Row], str]]
COLUMNS: Columns = {
    "governor": name,
    "network": lambda row: row.network,
    "runs": lambda row: (
        f"{len(row.runs)}" + (f", {len(row.runs) - len(row.ok)} failed" if len(row.ok) < len(row.runs) else "")
    ),
    "contacts [95 %]": lambda row: _rate(row.rate(lambda one: one.touched)),
    "crossings [95 %]": lambda row: _rate(row.rate(lambda one: one.crossed)),
    "least margin [m]": _least,
    "gap to the optimum [m]": lambda row: _of_some(row, GAP),
    "its geometric mean [m]": lambda row: number_text(row.gap),
    "distance left [m]": lambda row: _of_some(row, LEFT),
    "settling / none (settled)": _settling,
    "violated: ball / directional / predictive [%]": _shares,
    "infeasible [s]": lambda row: number_text(row.infeasible),
    "rounds": lambda row: number_text(row.mean("rounds_per_tick")),
    "messages": _messages,
    "bytes": _bytes,
}
NAMED = 2  # columns that say whose row it is


def _compared(name: str) -> Callable[[Row], str]:
    return lambda row: _difference(row.difference(name))


DIFFERENCES: Columns = dict(list(COLUMNS.items())[:NAMED]) | {
    "gap to the optimum [m]": _compared(GAP),
    "distance left [m]": _compared(LEFT),
    "settling time [s]": _compared(SETTLING),
    "least margin [m]": _compared(MARGIN),
}
WALL_CLOCK: Columns = dict(list(COLUMNS.items())[:NAMED]) | {
    "seeds": lambda row: NAMES[row.group],
    "compute a robot and tick [us]": lambda row: quartiles_text(row.compute_us()),
}
WALL_CLOCK_TITLE = "Wall clock, not reproducible: median [quartiles]"
DIFFERENCES_TITLE = f"differences to {WITHOUT} in the same world, mean [95 %] (pairs)"


RUN_COLUMNS: Mapping[str, Callable[[BenchRun], str]] = {
    "contact": lambda one: _yes(one.touched),
    "crossing": lambda one: _yes(one.crossed),
    "least margin [m]": lambda one: number_text(one.number(MARGIN)),
    "gap to the optimum [m]": lambda one: number_text(one.number(GAP)),
    "distance left [m]": lambda one: number_text(one.number(LEFT)),
    "settling time [s]": lambda one: number_text(one.number(SETTLING)),
    "violated: ball / directional / predictive [%]": lambda one: _shares_text(list(map(one.number, CERTIFICATES))),
    "infeasible [s]": lambda one: number_text(one.infeasible),
    "rounds": lambda one: number_text(one.number("rounds_per_tick")),
    "messages": lambda one: number_text(one.messages),
    "bytes": lambda one: number_text(one.number("sent_per_robot_per_tick_bytes")),
}
"""What a run has of the tables' columns."""


def cells(row: Row, columns: Columns) -> list[str]:
    """Return a row's cells."""
    return [cell(row) for cell in columns.values()]


def run_cells(one: BenchRun) -> list[str]:
    """Return how a run ended, and its cells of `RUN_COLUMNS`."""
    if not one.ok:
        return [f"failed: {one.record['error']}", *[NONE] * len(RUN_COLUMNS)]
    return [str(one.record["outcome"]), *(cell(one) for cell in RUN_COLUMNS.values())]


def link(row: Row, columns: Columns, column: str, runs: str = "") -> str | None:
    """Return where a cell leads: an extreme to its log, the governor to its runs in the file `runs`; None: nowhere."""
    if columns is COLUMNS and column == "least margin [m]" and (ordered := row.by_margin()):
        return f"{LOGS}/{ordered[0].log}"
    return f"{runs}#{row.anchor}" if column in ("governor", "runs") else None


def compared(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of `DIFFERENCES`: governors that ran in worlds in which `none` did."""
    return [row for row in rows if row.governor != WITHOUT and row.paired]
