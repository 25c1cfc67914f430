"""The page's tables, as HTML. Every text is escaped here: names and statuses come from files anybody may write."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from pbrg_mj.analysis.metrics.table import LAYOUT, WRAPPED, cell, shown, text
from pbrg_mj.analysis.report.report_run import ReportRun
from pbrg_mj.text import counted, plain

CARD = (
    ("simulated", "duration_s", "s"),
    ("gap to the best formation", "terminal_gap_m", "m"),
    ("settled after", "settling_time_s", "s"),
    ("least true margin", "true_margin_min_m", "m"),
    ("mean gap to m*", "optimality_gap_m.mean", "m"),
    ("spread of references, p95", "consensus_spread_m.p95", "m"),
    ("sent per robot per second", "sent_per_robot_per_second_bytes", ""),
)


def cards(report_runs: Sequence[ReportRun]) -> str:
    """Return a card per run: name, outcome, its main numbers, and a notice when the log is damaged."""
    return "\n".join(_card(number, one) for number, one in enumerate(report_runs, start=1))


def comparison(report_runs: Sequence[ReportRun]) -> str:
    """Return the table of `pbrg compare`, a column per run."""
    data = [one.numbers.as_dict() | {"log": one.log} for one in report_runs]
    heads = "".join(f'<th scope="col">{number}</th>' for number in range(1, len(data) + 1))
    rows = []
    for group, lines in LAYOUT.items():
        rows.append(f'<tr class="group"><th scope="colgroup" colspan="{len(data) + 1}">{escape(group)}</th></tr>')
        rows += [
            _row(label, [(text if key in WRAPPED else cell)(shown(one, key)) for one in data]) for label, key in lines
        ]
    return f'<table><thead><tr><th scope="col">run</th>{heads}</tr></thead><tbody>\n{_lines(rows)}\n</tbody></table>'


def scenarios(report_runs: Sequence[ReportRun]) -> str:
    """Return each run's scenario, folded up."""
    return "\n".join(
        f'<details><summary>{number}: {_text(one.numbers.scenario)}</summary><pre tabindex="0">'
        f"{escape(plain(one.scenario_yaml, keep=chr(10)))}</pre></details>"
        for number, one in enumerate(report_runs, start=1)
    )


def versions(report_runs: Sequence[ReportRun]) -> str:
    """Return the versions of each run's software, a column per run."""
    names = sorted({name for one in report_runs for name in one.versions})
    heads = "".join(f'<th scope="col">{number}</th>' for number in range(1, len(report_runs) + 1))
    rows = [_row(name, [plain(one.versions.get(name, "-")) for one in report_runs]) for name in names]
    return f'<table><thead><tr><th scope="col">run</th>{heads}</tr></thead><tbody>\n{_lines(rows)}\n</tbody></table>'


def _card(number: int, one: ReportRun) -> str:
    data = one.numbers.as_dict()
    facts = "".join(_fact(label, shown(data, key), unit) for label, key, unit in CARD)
    why = shown(data, "reason")
    reason = f" <small>{_text(why)}</small>" if why else ""
    binds = "".join(f"<li>{_text(one)}</li>" for one in one.numbers.binding)
    binding = f'<p class="binding">Binds at the end:</p><ul class="binding">{binds}</ul>' if binds else ""
    style = one.numbers.outcome.replace(" ", "-")
    notice = f'<p class="notice">Damaged log: {_text(one.numbers.damage)}</p>' if one.numbers.damage else ""
    robots = counted(one.numbers.robots, "robot")
    identity = f"{one.numbers.plant}, {shown(data, 'governor')}, {robots}, seed {one.numbers.seed}"
    held = f"{one.numbers.duration_s:g} of {one.numbers.asked_s:g} s: {one.numbers.ended}"
    return (
        f'<article class="card"><h2><span class="number">{number}</span>{_text(one.numbers.scenario)}</h2>'
        f'<p class="outcome {escape(style)}">{escape(one.numbers.outcome)}{reason}</p>{binding}'
        f'<p class="from">{_text(one.log)}: {_text(identity)}; {_text(held)}</p>{notice}<dl>{facts}</dl></article>'
    )


def _fact(label: str, value: object, unit: str) -> str:
    said = "" if value is None or not unit else f" <small>{escape(unit)}</small>"
    return f"<div><dt>{escape(label)}</dt><dd>{escape(cell(value))}{said}</dd></div>"


def _row(label: str, cells: Iterable[str]) -> str:
    values = "".join(f"<td>{escape(value)}</td>" for value in cells)
    return f'<tr><th scope="row">{_text(label.strip())}</th>{values}</tr>'


def _text(text: str) -> str:
    return escape(plain(text))


def _lines(rows: Iterable[str]) -> str:
    return "\n".join(rows)
