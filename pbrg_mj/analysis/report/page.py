"""The page: one file that asks the network for nothing, and may not.

Its policy names its own script and style by their hashes and forbids everything else, so that text from a
log could neither run nor load anything even if it were not escaped.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path

from pbrg_mj.analysis.output_file import by_suffix, check_place, write_atomically
from pbrg_mj.analysis.report import tables
from pbrg_mj.analysis.report.encode import embedded
from pbrg_mj.analysis.report.report_run import ReportRun
from pbrg_mj.text import plain

SUFFIXES = {".html": "", ".htm": ""}
SCRIPTS = ("elements", "figures", "data", "axes", "scene", "chart", "clock", "start")  # in the order they are needed


def check_page(path: Path) -> None:
    """Raise InputError if no page can be written to `path`: a wrong suffix or place."""
    by_suffix(path, SUFFIXES)
    check_place(path)


def write_page(report_runs: Sequence[ReportRun], path: Path) -> None:
    """Write the page of one or several runs to `path`. Raises InputError for a wrong suffix or place."""
    by_suffix(path, SUFFIXES)
    text = page(report_runs).encode()

    def write(whole: Path) -> None:
        whole.write_bytes(text)

    write_atomically(path, write)


def page(report_runs: Sequence[ReportRun]) -> str:
    """Return the page as HTML; the same runs give the same text."""
    script, style = _script(), _asset("style.css")
    parts = {
        "policy": f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'",
        "title": escape(_title(report_runs)),
        "style": style,
        "cards": tables.cards(report_runs),
        "comparison": tables.comparison(report_runs),
        "scenarios": tables.scenarios(report_runs),
        "versions": tables.versions(report_runs),
        "data": embedded([one.animation for one in report_runs]),
        "script": script,
    }
    before, *rest = _asset("page.html").split("{{")
    filled = ((part, after) for part, after in (piece.split("}}", 1) for piece in rest))
    return before + "".join(parts[part] + after for part, after in filled)


def _title(report_runs: Sequence[ReportRun]) -> str:
    names = dict.fromkeys(plain(one.numbers.scenario) for one in report_runs)
    return ", ".join(names) or "runs"


def _script() -> str:
    parts = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    return f"(() => {{\n'use strict';\n{parts}}})();\n"


def _asset(name: str) -> str:
    return files("pbrg_mj.analysis.report").joinpath("assets", name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return "sha256-" + b64encode(sha256(text.encode()).digest()).decode()
