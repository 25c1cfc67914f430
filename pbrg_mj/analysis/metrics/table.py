"""Metrics of one or several runs as aligned plain text, one column per run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, repeat, zip_longest
from textwrap import wrap
from typing import Any

from pbrg_mj.analysis.metrics.outcome import reason_text
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics
from pbrg_mj.text import format_significant, plain

LABEL_WIDTH = 38
COLUMN_WIDTH = 29  # two runs fit 100 columns
WRAPPED = {"governor", "reason", "binding"}  # keys of texts that take as many lines as they need
# group -> rows of (label with unit, key in the JSON)
LAYOUT: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (
        ("log", "log"),
        ("scenario", "scenario"),
        ("plant", "plant"),
        ("governor", "governor"),
        ("seed", "seed"),
        ("robots", "robots"),
        ("simulated [s]", "duration_s"),
        ("asked for [s]", "asked_s"),
        ("ended", "ended"),
        ("ticks", "ticks"),
    ),
    "outcome": (
        ("outcome", "outcome"),
        ("reason", "reason"),
        ("violated by robot", "violation_robot"),
        ("violated at [s]", "violation_time_s"),
        ("best formation x [m]", "target_x_m"),
        ("best formation y [m]", "target_y_m"),
        ("terminal gap [m]", "terminal_gap_m"),
        ("settling time [s]", "settling_time_s"),
        ("  also of a violated run [s]", "settling_time_including_violated_s"),
        ("comes closer at [m/s]", "closing_rate_m_s"),
        ("  would arrive at [s]", "arrival_time_s"),
        ("  would level off at [m]", "extrapolated_gap_m"),
        ("binds at the end", "binding"),
    ),
    "safety": (
        ("true margin, least [m]", "true_margin_min_m"),
        ("true margin at rest [m]", "rest_margin_m"),
        ("  to moving boxes alone, least [m]", "moving_margin_min_m"),
        ("gap between robots, least [m]", "robot_gap_min_m"),
        ("contacts with walls", "wall_contacts"),
        ("contacts with moving boxes", "moving_contacts"),
        ("  first ones that were avoidable", "moving_contacts_avoidable"),
        ("contacts with robots", "robot_contacts"),
        ("  contact with walls [s]", "wall_contact_s"),
        ("  contact with moving boxes [s]", "moving_contact_s"),
        ("  contact with robots [s]", "robot_contact_s"),
        ("sensed margin, least [m]", "sensed_margin_min_m"),
        ("own certificate", "own_certificate"),
        ("  its horizon [s]", "own_certificate_horizon_s"),
        ("ball row, largest [m]", "certificate_worst_m"),
        ("  ball, violated share", "certificate_violated_share"),
        ("directional ball row, largest [m]", "directional_ball_worst_m"),
        ("  directional ball, violated share", "directional_ball_violated_share"),
        ("predictive row, largest [m]", "predictive_worst_m"),
        ("  predictive, violated share", "predictive_violated_share"),
        ("first half-space at [s]", "first_half_space_s"),
        ("integral state, largest [m]", "xi_max_m"),
        ("integrator wind-up [s]", "winding_up_s"),
    ),
    "distributed against centralized": (
        ("optimality gap, mean [m]", "optimality_gap_m.mean"),
        ("optimality gap, p95 [m]", "optimality_gap_m.p95"),
        ("optimality gap, final [m]", "optimality_gap_m.final"),
        ("  leaders alone, mean [m]", "leader_optimality_gap_m.mean"),
        ("  leaders alone, p95 [m]", "leader_optimality_gap_m.p95"),
        ("  leaders alone, final [m]", "leader_optimality_gap_m.final"),
        ("sensing gap of m*, mean [m]", "sensing_gap_m.mean"),
        ("sensing gap of m*, p95 [m]", "sensing_gap_m.p95"),
        ("sensing gap of m*, final [m]", "sensing_gap_m.final"),
        ("cost gap, mean [m^2]", "cost_gap_m2.mean"),
        ("cost gap, p95 [m^2]", "cost_gap_m2.p95"),
        ("cost gap, final [m^2]", "cost_gap_m2.final"),
        ("consensus spread, mean [m]", "consensus_spread_m.mean"),
        ("consensus spread, p95 [m]", "consensus_spread_m.p95"),
        ("consensus spread, final [m]", "consensus_spread_m.final"),
        ("governor not ok, share of time", "governor_not_ok_share"),
        ("reference solves", "reference_ticks"),
        ("reference infeasible, share", "reference_infeasible_share"),
        ("reference failed, share", "reference_failed_share"),
    ),
    "network": (
        ("rounds per tick", "rounds_per_tick"),
        ("sent per robot per tick", "sent_per_robot_per_tick_bytes"),
        ("sent per robot per second", "sent_per_robot_per_second_bytes"),
        ("sent per robot in all", "sent_per_robot_total_bytes"),
        ("  p and xi of eq. 2, per tick", "pre_stabiliser_per_robot_per_tick_bytes"),
    ),
    "wall clock": (
        ("distributed tick, median [ms]", "governor_ms.median"),
        ("distributed tick, p95 [ms]", "governor_ms.p95"),
        ("centralized build, median [ms]", "reference_build_ms.median"),
        ("centralized build, p95 [ms]", "reference_build_ms.p95"),
        ("centralized solve, median [ms]", "reference_solve_ms.median"),
        ("centralized solve, p95 [ms]", "reference_solve_ms.p95"),
        ("simulated per wall second", "real_time_factor"),
    ),
}
CENTRALIZED = "centralized"
OWN = {
    "certificate_violated_share": "ball",
    "directional_ball_violated_share": "directional_ball",
    "predictive_violated_share": "predictive",
}
BYTES = {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
SHORT = (
    "scenario",
    "duration_s",
    "outcome",
    "reason",
    "binding",
    "terminal_gap_m",
    "settling_time_s",
    "true_margin_min_m",
    "optimality_gap_m.mean",
    "consensus_spread_m.p95",
    "sent_per_robot_per_second_bytes",
    "real_time_factor",
    "log",
)


def comparison_table(runs: Sequence[RunMetrics], own: Sequence[Mapping[str, float | None]] = ()) -> str:
    """Return the table; values are those of `RunMetrics.as_dict`, four digits, "-" where one does not apply.

    `own` are numbers besides, by name, of each run; they come last.
    """
    data = [run.as_dict() for run in runs]
    lines: list[str] = []
    for group, rows in LAYOUT.items():
        lines += ["", group] if lines else [group]
        for label, key in rows:
            values = [shown(run, key) for run in data]
            lines += _wrapped(f"  {label}", values) if key in WRAPPED else [_line(f"  {label}", values)]
    names = list(dict.fromkeys(name for values in own for name in values))
    lines += ["", "own metrics"] if names else []
    lines += [_line(f"  {plain(name)}", [values.get(name) for values in own]) for name in names]
    return "\n".join(lines)


def short_summary(run: RunMetrics) -> str:
    """Return the rows of the table that sum up a run's end."""
    data = run.as_dict()
    labels = {key: label.strip() for rows in LAYOUT.values() for label, key in rows}
    lines: list[str] = []
    for key in SHORT:
        texts = sentences(shown(data, key)) if key in WRAPPED else [text(shown(data, key))]
        lines += [f"{label:<{LABEL_WIDTH}}  {line}" for label, line in zip_longest([labels[key]], texts, fillvalue="")]
    return "\n".join(lines)


def look_up(data: dict[str, Any], key: str) -> Any:
    """Return the value at a dotted key of nested data."""
    for part in key.split("."):
        data = data[part]
    return data


def shown(data: dict[str, Any], key: str) -> Any:
    """Return the value at a key as it stands in a table: numbers of bytes with the unit a person reads.

    Of a governor that sees the whole team its name says so, and so does what stands in place of bytes. The violated
    share of the run's own certificate is marked, and the reason of a violation has its robot and time.
    """
    value = look_up(data, key)
    if key == "reason":
        return reason_text(value, data["violation_robot"], data["violation_time_s"])
    if data["centralized"] and key.endswith("_bytes"):
        return CENTRALIZED
    if data["centralized"] and key == "governor" and value != CENTRALIZED:
        return f"{value} ({CENTRALIZED})"
    if key in OWN and OWN[key] == data["own_certificate"] and value is not None:
        return f"{text(value)} (own)"
    return amount(value) if key.endswith("_bytes") and isinstance(value, float) else value


def amount(count: float) -> str:
    """Return a number of bytes in B, kB, MB, GB or TB, by powers of 1000: 704 kB."""
    unit = next((name for name in BYTES if abs(count) < 1000.0 * BYTES[name]), "TB")
    return f"{format_significant(count / BYTES[unit], 4)} {unit}"


def cell(value: Any) -> str:
    """Return a value as text of at most COLUMN_WIDTH characters; the end of a long text says more than its start."""
    whole = text(value)
    return whole if len(whole) <= COLUMN_WIDTH else "..." + whole[3 - COLUMN_WIDTH :]


def text(value: Any) -> str:
    """Return a value as text: four digits, "-" where there is none, several sentences with semicolons."""
    if isinstance(value, tuple | list):
        return "; ".join(map(text, value)) or "-"
    if value is None:
        return "-"
    return _number(value) if isinstance(value, float) else plain(str(value))


def sentences(value: Any) -> list[str]:
    """Return the texts of a value that holds several, one of one that does not."""
    return list(map(text, value)) or ["-"] if isinstance(value, tuple | list) else [text(value)]


def _wrapped(label: str, values: list[Any]) -> list[str]:
    """Return the lines of a row of sentences: each begins a line, and goes on a little further in."""
    columns = [
        [line for sentence in sentences(value) for line in wrap(sentence, COLUMN_WIDTH, subsequent_indent="  ")]
        for value in values
    ]
    if all(len(column) == 1 for column in columns):
        return [_line(label, values)]
    labels, rows = chain([label], repeat("")), zip_longest(*columns, fillvalue="")
    return [
        f"{next(labels):<{LABEL_WIDTH}}{''.join(f'  {one:<{COLUMN_WIDTH}}' for one in row)}".rstrip() for row in rows
    ]


def _number(value: float) -> str:
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else format_significant(value, 4)


def _line(label: str, values: list[Any]) -> str:
    cells = "".join(f"  {cell(value):>{COLUMN_WIDTH}}" for value in values)
    return f"{label:<{LABEL_WIDTH}}{cells}"
