"""The notebook runs from its first cell to its last, and says what its text promises."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from tests.needs import need_module

NOTEBOOK = Path(__file__).parents[1] / "docs" / "notebooks" / "first_experiment.ipynb"


def read():
    return nbformat.read(NOTEBOOK, as_version=4)


def test_it_is_kept_without_outputs():
    for cell in read().cells:
        assert cell.cell_type == "markdown" or (cell.outputs == [] and cell.execution_count is None)


def test_its_governor_has_ten_lines():
    (cell,) = (cell for cell in read().cells if "class " in cell.source)
    assert len([line for line in cell.source.splitlines() if line.strip()]) <= 10


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore:Proactor event loop:RuntimeWarning")
def test_it_runs(tmp_path, monkeypatch):
    need_module("matplotlib")
    root = str(NOTEBOOK.parents[2])
    monkeypatch.setenv("PYTHONPATH", root)
    monkeypatch.delenv("MPLBACKEND", raising=False)
    book = read()
    NotebookClient(book, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    said = "".join(out.get("text", "") for cell in cells for out in cell.outputs)
    assert "<Scenario paper/experiment_near: 5 robots, physics plant, 20 s>" in said
    assert "distributed against centralized" in said and "(centralized)" in said
    pictures = [out for cell in cells for out in cell.outputs if "image/png" in out.get("data", {})]
    assert len(pictures) == 3
    assert [out for cell in cells for out in cell.outputs if out.output_type == "stream" and out.name == "stderr"] == []
