"""The data of measured worlds: a line a world, with the version of the code that was run."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs" / "data" / "worlds.json"
PAGE, HISTORY = ROOT / "docs" / "worlds.md", ROOT / "docs" / "worlds-history.md"
RUN = ("pbrg_mj", "models", "scenarios")  # what results depend on
EVENTS = {
    "touches what stands still": "touching",
    "past its line": "past_a_wall",
    "robots touch": "touching_robots",
    "touches a moving box": "touching_moving",
    "avoidably": "touching_moving_avoidably",
    "past a moving box's line": "past_a_moving_box",
}
COLUMNS = (
    *EVENTS.values(),
    "violated",
    "robots",
    "wall_margin_m",
    "moving_margin_m",
    "final_distance_m",
    "met",  # robots whose straight way meets something
    "past",  # those beyond it at the end
    "past_after_8_s",
    "past_sliding",  # those of a formation that knows all and only ever comes nearer
    "simulated_s",
    "version",
)
Worlds = dict[str, dict[str, list[Any]]]  # of "set-up family" and what else was set, by seed; values in COLUMNS' order


def version() -> str:
    """Return the last commit that changed what results depend on, with a + where there are changes since."""
    commit = _git("log", "-1", "--format=%h", "--abbrev=7", "--", *RUN)
    return commit + ("+" if _git("status", "--porcelain", "--", *RUN) else "")


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def read() -> tuple[Worlds, list[str]]:
    """Return all worlds, and the versions in the order in which they were measured."""
    if not DATA.is_file():
        return {}, []
    content = json.loads(DATA.read_text(encoding="utf-8"))
    return content["worlds"], content["versions"]


def write(data: Worlds, versions: list[str]) -> None:
    write_worlds(DATA, {"columns": COLUMNS, "versions": versions}, data)


def write_worlds(path: Path, head: dict[str, Any], data: Worlds) -> None:
    """Write a line a world, at once: who is interrupted leaves a whole file."""
    blocks = [
        f"{json.dumps(key)}: {{\n"
        + ",\n".join(f"{json.dumps(seed)}: {json.dumps(rows[seed])}" for seed in sorted(rows, key=int))
        + "\n}"
        for key, rows in sorted(data.items())
    ]
    heads = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in head.items())
    part = path.with_suffix(".part")
    part.write_text("{" + heads + '"worlds": {\n' + ",\n".join(blocks) + "\n}}\n", encoding="utf-8")
    part.replace(path)


def write_between(mark: str, made: str, page: Path = PAGE) -> None:
    """Put a text between the two places of a page that have this mark."""
    before, _, after = page.read_text(encoding="utf-8").split(mark)
    page.write_text(f"{before}{mark}\n{made}\n{mark}{after}", encoding="utf-8")
