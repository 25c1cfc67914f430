"""The table as one page that asks the network for nothing: pictures, logs and commands with it."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from hashlib import sha256
from html import escape
from pathlib import Path

from pbrg_mj.api.logs import open as open_log
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
from pbrg_mj.studies.bench.pictures import LEGEND, picture
from pbrg_mj.studies.bench.suite import Suite
from pbrg_mj.studies.bench.table import BenchRun, Row
from pbrg_mj.studies.runner import LOGS
from pbrg_mj.text import counted

STYLE = """
body { font: 14px/1.45 system-ui, sans-serif; margin: 2em; color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1em 0; }
th, td { padding: .3em .6em; border: 1px solid #ccc; text-align: left; }
th { background: #f2f2f2; font-weight: 600; }
code { font-size: 12px; }
figure { display: inline-block; margin: .5em 1em .5em 0; }
svg { border: 1px solid #ccc; } figcaption { font-size: 12px; }
"""


def page(suite: Suite, rows: Sequence[Row], folder: Path, versions: Mapping[str, str]) -> str:
    """Return the page as HTML; `folder` has the logs. All text is escaped, and the page's policy forbids scripts."""
    digest = "sha256-" + b64encode(sha256(STYLE.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src '{digest}'; base-uri 'none'; form-action 'none'"
    heading = escape(suite.title)
    made = ", ".join(f"{escape(package)} {escape(version)}" for package, version in versions.items())
    parts = [
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{heading}</title>',
        f'<meta http-equiv="Content-Security-Policy" content="{escape(policy)}"><style>{STYLE}</style></head><body>',
        f"<h1>{heading}</h1><p>{counted(len(suite.tasks), 'run')}. {made}</p>",
        *(_tables(rows, group) for group in NAMES),
        f"<h2>{escape(WALL_CLOCK_TITLE)}</h2>{_table(WALL_CLOCK, rows)}",
        "<h2>Tunings</h2><ul>",
        *(f"<li>{escape(governor)}: {escape(tuning)}</li>" for governor, tuning in suite.tunings.items()),
        f"</ul><h2>Runs</h2><p>{LEGEND}</p>",
        *(_runs(row, folder) for row in rows),
        "</body></html>\n",
    ]
    return "\n".join(parts)


def _tables(rows: Sequence[Row], group: str) -> str:
    shown = [row for row in rows if row.group == group]
    part, pairs = escape(NAMES[group].capitalize()), compared(shown)
    differences = f"<h3>{part}: {escape(DIFFERENCES_TITLE)}</h3>{_table(DIFFERENCES, pairs)}" if pairs else ""
    return f"<h2>{part}</h2>{_table(COLUMNS, shown)}{differences}"


def _table(columns: Columns, rows: Sequence[Row]) -> str:
    lines = ["".join(f"<td>{_cell(row, columns, column)}</td>" for column in columns) for row in rows]
    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><tr>{head}</tr>{body}</table>"


def _cell(row: Row, columns: Columns, column: str) -> str:
    cell, place = escape(columns[column](row)), link(row, columns, column)
    return f'<a href="{escape(place)}">{cell}</a>' if place else cell


def _runs(row: Row, folder: Path) -> str:
    ordered, others = row.by_margin(), row.others()
    middle = "median" if len(ordered) % 2 else "lower median"
    shown = {"worst": ordered[0], middle: ordered[(len(ordered) - 1) // 2]} if ordered else {}
    figures = "".join(_figure(word, one, folder) for word, one in shown.items())
    lines = "".join(_run(one, others.get(one.log)) for one in row.runs)
    head = "".join(f"<th>{escape(one)}</th>" for one in ("log", "ended", *RUN_COLUMNS, "compared with", "command"))
    return f'<h3 id="{row.anchor}">{escape(title(row))}</h3>{figures}<table><tr>{head}</tr>{lines}</table>'


def _figure(word: str, one: BenchRun, folder: Path) -> str:
    log = folder / LOGS / one.log
    if not log.is_file():
        return ""
    text = f"{word} margin, {one.record['true_margin_min_m']:.3g} m: {one.log}"
    caption = f'<a href="{LOGS}/{escape(one.log)}">{escape(text)}</a>'
    return f"<figure>{picture(open_log(log))}<figcaption>{caption}</figcaption></figure>"


def _run(one: BenchRun, other: BenchRun | None) -> str:
    command = f"<code>{escape(one.task.command(one.log))}</code>"
    cells = [_log(one), *map(escape, run_cells(one)), _log(other), command]
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _log(one: BenchRun | None) -> str:
    if one is None:
        return NONE
    return f'<a href="{LOGS}/{escape(one.log)}">{escape(one.log)}</a>' if one.ok else escape(one.log)
