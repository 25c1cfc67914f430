"""The reference page is up to date, and each quantity has one unit."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_the_page_is_up_to_date() -> None:
    script = ROOT / "scripts" / "make_scenario_docs.py"
    done = subprocess.run([sys.executable, script, "--check"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_number_has_one_unit() -> None:
    rows = [
        [cell.strip() for cell in line.replace(r"\|", "").split("|")[1:-1]]
        for line in (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| `")
    ]
    assert len(rows) > 50
    numbers = [row for row in rows if " number" in row[1] and "whole number" not in row[1]]
    assert [row[0] for row in numbers if len(row[2].split()) != 1] == []
