"""After ./scripts/demo the next lines of the README work: names and extras are those of the script."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

TOP = Path(__file__).parents[1]
DEMO = (TOP / "scripts" / "demo").read_text(encoding="utf-8")
LINES = re.findall(r"^    \$ (pbrg [^#\n]*)", (TOP / "README.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
SUFFIXES = (".mcap", ".yaml")
COMMANDS = (TOP / "docs" / "commands.md").read_text(encoding="utf-8")
EXTRAS = {  # what commands need
    "plot": "plot",
    "reproduce": "plot",
    "render": "video",
    "report": "video",
    "tune": "tune",
    "falsify": "tune",
}


def files(line: str) -> tuple[set[str], set[str]]:
    """Return which files a command reads and which it makes."""
    words = line.split()
    made = {words[i + 1] for i, word in enumerate(words[:-1]) if word == "-o"}
    made |= {word for word in words if words[1] == "new" and word.endswith(SUFFIXES)}
    return {word for word in words if word.endswith(SUFFIXES)} - made, made


def test_every_file_a_line_reads_was_made_by_the_demo_or_a_line_before_or_stands_on_the_commands_page():
    assert len(LINES) > 10
    there = {name for line in re.findall(r"\.venv/bin/(pbrg .*)", DEMO) for name in files(line)[1]}
    assert there == {"near.mcap"}
    there |= set(re.findall(r"^ +\$ cat (\S+)$", COMMANDS, flags=re.MULTILINE))
    for line in LINES:
        read, made = files(line)
        assert read <= there, line
        there |= made


def test_the_demo_runs_the_readmes_first_line():
    assert f".venv/bin/{LINES[0].strip()}\n" in DEMO


def test_the_demo_installs_what_the_lines_need():
    installed = set(re.search(r"^\./scripts/setup (\S+)$", DEMO, flags=re.MULTILINE)[1].split(","))
    assert {EXTRAS[line.split()[1]] for line in LINES if line.split()[1] in EXTRAS} <= installed
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))
    assert installed <= set(project["project"]["optional-dependencies"])


def test_hints_name_packages_of_the_extras():
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    known = [*project["dependencies"], *(one for extra in project["optional-dependencies"].values() for one in extra)]
    names = {re.match(r"[\w-]+", one)[0] for one in known}
    for path in (TOP / "pbrg_mj").rglob("*.py"):
        for hint in re.findall(r"pip install '?([\w-]+)", path.read_text(encoding="utf-8")):
            assert hint in names, f"{path.name}: {hint}"


def test_scripts_take_the_checkouts_python():
    for path in (TOP / "scripts").iterdir():
        if path.is_file() and path.suffix == "":
            assert path.read_text(encoding="utf-8").startswith("#!/usr/bin/env bash\n"), path.name
