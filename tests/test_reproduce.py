"""`pbrg reproduce`, on runs cut short."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics import paper_table as paper
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.api import reproduce as reproducing
from pbrg_mj.cli.main import main
from tests.needs import need_module
from tests.runs import replaced, run

ROOT = Path(__file__).parents[1]
FILES = {f"{name}.{kind}" for name in paper.RUNS for kind in ("mcap", "pdf", "png")} | {"numbers.md", "numbers.json"}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    need_module("matplotlib")
    top = tmp_path_factory.mktemp("reproduced")
    for name in ("first", "second"):
        assert main(["reproduce", "-o", str(top / name / "deep"), "--duration", "0.2"]) == 0
    return top / "first" / "deep", top / "second" / "deep"


def test_every_file_is_there_and_nothing_else(folders):
    assert {path.name for path in folders[0].iterdir()} == FILES
    for path in folders[0].iterdir():
        assert path.stat().st_size > 1000, path.name


def test_a_second_run_makes_the_same_bytes(folders):
    for name in FILES:
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes(), name


def test_numbers_are_those_of_compare(folders, monkeypatch, capsys):
    monkeypatch.chdir(folders[0])
    assert main(["compare", *(f"{name}.mcap" for name in paper.RUNS), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(Path("numbers.json").read_text())


def test_the_table_holds_the_numbers(folders):
    rows = [line.strip("| ").split(" | ") for line in (folders[0] / "numbers.md").read_text().splitlines()]
    table = {row[0]: row[1:] for row in rows[2:]}
    numbers = json.loads((folders[0] / "numbers.json").read_text())
    assert table["simulated [s]"] == ["0.2"] * 4
    assert table["plant"] == ["ideal", "ideal", "physics", "physics"]
    for label, key in (("terminal gap [m]", "terminal_gap_m"), ("ball row, largest [m]", "certificate_worst_m")):
        assert [float(text) for text in table[label]] == pytest.approx([one[key] for one in numbers], rel=1e-3)


def test_the_runs_are_the_papers(folders):
    """r, gains and targets as section 5 has them."""
    found = [pbrg.open(folders[0] / f"{name}.mcap").scenario.settings for name in paper.RUNS]
    assert [one.operator.reference for one in found] == [(1.0, 2.0), (2.0, 3.0), (1.4, 1.18), (1.8, 2.0)]
    assert [one.governor.alpha for one in found] == [2.0, 2.0, 7.0, 7.0]
    assert [one.control.alpha_r for one in found] == [1.0, 1.0, 2.5, 2.5]


def test_a_cell_cannot_break_the_table():
    made = metrics(run())
    text = paper.markdown([replaced(made, reason="a | b"), made])
    assert {line.replace("\\|", "").count("|") for line in text.splitlines()} == {4}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "output"),
        (["-o", "file"], "not a folder"),
        (["-o", "new", "--duration", "-1"], "timing.duration"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(monkeypatch, tmp_path, capsys, arguments, says):
    need_module("matplotlib")
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    assert main(["reproduce", *arguments]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_a_violated_run_exits_with_1(monkeypatch, tmp_path):
    need_module("matplotlib")
    made = metrics(run())
    monkeypatch.setattr(reproducing, "_simulate", lambda scenario, path, watch: (path, None))
    outcomes = iter(("converged", "violated", "moving", "converged"))
    monkeypatch.setattr(reproducing, "_evaluate", lambda log, _run: replaced(made, outcome=next(outcomes)))
    assert main(["reproduce", "-o", str(tmp_path)]) == 1


def test_ctrl_c_leaves_whole_files_alone(tmp_path):
    """Pressed in the second run: the first run's files and tables of it are there, no trace of the second."""
    need_module("matplotlib")
    command = [sys.executable, "-m", "pbrg_mj.cli.main", "reproduce", "-o", str(tmp_path), "--duration", "2"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        second = tmp_path / f".{paper.RUNS[1]}-part.mcap.part"
        while not second.exists():
            assert process.poll() is None
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    assert process.returncode == 130
    assert errors == f"interrupted; whole in {tmp_path}: simulation_near\n"
    whole = {f"simulation_near.{kind}" for kind in ("mcap", "pdf", "png")} | {"numbers.md", "numbers.json"}
    assert {path.name for path in tmp_path.iterdir()} == whole
    assert [one["scenario"] for one in json.loads((tmp_path / "numbers.json").read_text())] == ["paper/simulation_near"]
