"""The measured figures as the tables of docs/performance.md."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- measured: scripts/perf --page -->", "<!-- end of what is measured -->"


def write_page(path: Path, figures: dict[str, Any]) -> None:
    """Put the tables between the page's two marks."""
    before, rest = path.read_text(encoding="utf-8").split(BEGIN)
    _, after = rest.split(END)
    path.write_text(f"{before}{BEGIN}\n\n{tables(figures)}\n\n{END}{after}", encoding="utf-8")


def tables(figures: dict[str, Any]) -> str:
    """Return all tables, each under its heading."""
    parts = {
        "Against the targets": _targets(figures),
        "A round, as the team grows": _rounds(figures["rounds"]),
        "Against peers on the same work": _peers(figures),
        "Perception": _perception(figures["perception"]),
        "Teams in physics": _teams(figures["teams"]),
    }
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in parts.items())


def _targets(figures: dict[str, Any]) -> str:
    closed, starts, worlds = figures["closed_loop"], figures["starts"], figures["worlds"]
    rounds = {one["robots"]: one for one in figures["rounds"]}
    growth = max(one["seconds"] / one["streaming"] for n, one in rounds.items() if n >= 50)
    central, perception = figures["centralized"], max(one["us"] for one in figures["perception"].values())
    memory = figures["memory"]
    rows = [
        ("closed loop over bare `mj_step`", f"{closed['closed_loop_over_bare']:.2f}", "<= 1.5"),
        (
            "the same with log and centralized reference at every tick",
            f"{closed['logged_with_reference_over_bare']:.2f}",
            "<= 2.0",
        ),
        ("closed loop with the recommended set-up", f"{closed['recommended_over_bare']:.2f}", "<= 1.5"),
        ("log: time added to a tick's compute", f"{100 * closed['log_over_tick']:.0f} %", "<= 10 %"),
        ("one round, five robots, one half-space", f"{1e6 * rounds[5]['seconds']:.2f} us", "<= 1.5 us"),
        ("a round over streaming its bytes, 50 to 200 robots, worst", f"{growth:.1f}", "<= 2"),
        ("centralized solve, Clarabel's call", f"{1e6 * central['clarabel_call']:.0f} us", "<= 100 us"),
        ("centralized solve with building and reading", f"{1e6 * central['ours']:.0f} us", "<= 100 us"),
        ("perception, five scans of 72 beams, worst scene", f"{perception:.0f} us", "<= 300 us"),
        (
            f"{worlds['worlds']} worlds on {worlds['threads']} threads over bare `mujoco.batch`",
            f"{100 * worlds['worlds_over_bare_batch']:.0f} %",
            ">= 75 %",
        ),
        (
            "the same with the recommended set-up",
            f"{100 * worlds['recommended_worlds_over_bare_batch']:.0f} %",
            ">= 75 %",
        ),
        ("`pbrg run` to the first simulated second", f"{starts['first_simulated_second_s']:.2f} s", "<= 2.5 s"),
        ("`pbrg --help`", f"{starts['help_s']:.2f} s", "<= 0.4 s"),
        ("memory of ten minutes after the first ten seconds", f"+{memory['memory_growth_mb']:.1f} MB", "flat"),
    ]
    note = (
        f"A bare tick of five physics steps took {closed['bare_tick_us']:.0f} us; {worlds['worlds']} worlds ran "
        f"{worlds['worlds_simulated_s_per_s']:.0f} simulated seconds a second, bare "
        f"{worlds['bare_batch_simulated_s_per_s']:.0f}; a round of 1,000 robots "
        f"{1e3 * figures['round_of_a_thousand_s']:.0f} ms; the run of ten minutes held {memory['memory_mb']:.0f} MB."
    )
    return f"{_table(('what', 'measured', 'target'), rows)}\n\n{note}"


def _rounds(rounds: list[dict[str, float]]) -> str:
    rows = [
        (
            f"{one['robots']}",
            f"{1e6 * one['seconds']:.2f}",
            f"{one['megabytes']:.3f}",
            f"{1e6 * one['streaming']:.2f}",
            f"{one['seconds'] / one['streaming']:.1f}",
        )
        for one in rounds
    ]
    return _table(("robots", "round [us]", "read and written [MB]", "streaming that [us]", "ratio"), rows)


def _peers(figures: dict[str, Any]) -> str:
    rows = []
    for work, name in (("hundred_rounds", "100 rounds, five robots"), ("centralized", "centralized solve")):
        one = figures[work]
        rows.append((name, "ours", f"{1e3 * one['ours']:.3f}", "1", "-"))
        for peer, spent in one["peers"].items():
            label = peer.replace("_", " ")
            rows.append((name, label, f"{1e3 * spent:.3f}", f"{spent / one['ours']:.0f}", f"{one['apart'][peer]:.0e}"))
    return _table(("work", "by", "time [ms]", "over ours", "answers apart"), rows)


def _perception(scenes: dict[str, dict[str, float]]) -> str:
    rows = [(f"`{name}`", f"{one['scans']} x {one['beams']}", f"{one['us']:.0f}") for name, one in scenes.items()]
    return _table(("scene", "scans x beams", "time [us]"), rows)


def _teams(teams: list[dict[str, Any]]) -> str:
    stages = list(dict.fromkeys(stage for team in teams for stage in team["stages_us"]))
    rows = [
        (f"{one['robots']}", f"{one['real_time_factor']:.2f}", *(f"{one['stages_us'].get(s, 0):.0f}" for s in stages))
        for one in teams
    ]
    return _table(("robots", "x real time", *(f"{stage} [us]" for stage in stages)), rows)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
