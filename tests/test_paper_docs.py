"""docs/paper.md names functions, files and an equation count: they must be there."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
PLACES = sorted(set(re.findall(r"`([\w/]+)\.py:([\w.]+)`", PAGE)))


@pytest.mark.parametrize(("file", "name"), PLACES)
def test_every_function_is_there(file, name):
    found = importlib.import_module("pbrg_mj." + file.replace("/", "."))
    for part in name.split("."):
        fields = getattr(found, "__dataclass_fields__", {})
        found = fields[part] if part in fields else getattr(found, part)


def test_no_equation_is_left_out():
    rows = [line.split("|")[1] for line in PAGE.splitlines() if re.match(r"\| (Lemma 3, )?\(\d", line)]
    table = rows[: next(i for i, row in enumerate(rows) if "(45)" in row) + 1]
    named = set()
    for row in table:
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", row):
            named |= set(range(int(first), int(last or first) + 1))
    assert named == set(range(1, 46))


def test_the_law_of_the_terminal_gap_solves_its_equation():
    """dA/dN = tan phi along the closed form, and the rest point of a run with the exact optimum."""
    law = _script("terminal_gap").law()
    A, N, X = 0.4, 2.0, 1.4
    ends = [law.rest(A, N, X + step)[0] for step in (-1e-5, 1e-5)]
    assert np.diff(ends)[0] / 2e-5 == pytest.approx(np.tan(law.rest(A, N, X)[1]), rel=1e-4)
    assert law.rest(A, N, N - 1e-6)[0] == pytest.approx(A, abs=2e-6)
    measured = json.loads((ROOT / "docs/data/terminal_gap.json").read_text())["summary"]["inadmissible, exact optimum"]
    assert measured["terminal_gap_at_end_m"] == pytest.approx(measured["terminal_gap_law_m"], abs=5e-3)
    assert measured["rate_60_to_90_s"] == pytest.approx(measured["rate_law"], rel=0.03)


def _script(name):
    """Return a script as a module; dataclasses look their module up by its name."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("joblib")
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
