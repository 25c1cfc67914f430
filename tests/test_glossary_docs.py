"""docs/glossary.md and docs/architecture.md name files, keys, packages and modules: they must be there."""

from __future__ import annotations

import re
from pathlib import Path

from pbrg_mj.scenario.schema.describe import keys, section_at

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "pbrg_mj"
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text("utf-8")
ARCHITECTURE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
NAMES = re.findall(r"`([a-z_]+(?:[./][a-z_]+)+/?)`", GLOSSARY)


def test_the_glossarys_files_and_keys_are_there():
    files = [name for name in NAMES if "/" in name]
    assert len(files) > 20
    assert [name for name in files if not (PACKAGE / name).exists()] == []
    for name in (name for name in NAMES if "/" not in name and name != "optimum.m"):
        *sections, key = name.split(".")
        assert key in keys(section_at(tuple(sections))), name


def test_the_terms_are_in_alphabetical_order():
    terms = re.findall(r"^\| ([^|]+?) \|", GLOSSARY.split("## Terms")[1], re.MULTILINE)[1:]
    assert terms == sorted(terms, key=str.lower)
    assert "| term |" in GLOSSARY and len(terms) > 30


def test_every_package_lists_its_modules():
    for file in PACKAGE.rglob("*/__init__.py"):
        there = {path.stem for path in file.parent.glob("*.py")} - {"__init__"}
        there |= {path.parent.name for path in file.parent.glob("*/__init__.py")}
        listed = set(re.findall(r"\w+", file.read_text("utf-8").split('"""')[1]))
        assert sorted(there - listed) == [], file.parent.name


def test_the_architectures_table_lists_every_package_and_its_modules():
    rows = dict(re.findall(r"^\| \[`(\w+)`\].*\| ([^|]+) \|$", ARCHITECTURE, re.MULTILINE))
    assert set(rows) == {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    for package, listed in rows.items():
        for module in re.findall(r"`(\w+)`", listed):
            folder = PACKAGE / package / module
            assert folder.is_dir() or folder.with_suffix(".py").is_file(), (package, module)
