"""`pbrg list --json`, `show`, `new`, `schema`, completion in the shell, and `python -m pbrg_mj`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.scenario.bundled import bundled_scenarios

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


def test_list_json_holds_what_the_lines_hold(capsys):
    assert main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(maxsplit=1) for line in lines] == [[one["name"], one["description"]] for one in listed]
    near = next(one for one in listed if one["name"] == "paper/experiment_near")
    assert (near["robots"], near["plant"], near["duration_s"]) == (5, "physics", 90.0)


def test_show_prints_the_file_as_it_is(capsys):
    assert main(["show", "paper/experiment_near"]) == 0
    file = bundled_scenarios()["paper/experiment_near"]
    assert capsys.readouterr().out == file.read_text(encoding="utf-8")
    assert main(["show", "paper/experiment_nea"]) == 2
    assert "did you mean paper/experiment_near?" in capsys.readouterr().err


def test_new_writes_a_scenario_that_validates_and_runs(capsys):
    assert main(["new"]) == 0
    printed = capsys.readouterr().out
    assert main(["new", "mine.yaml"]) == 0
    assert Path("mine.yaml").read_text(encoding="utf-8") == printed == pbrg.template()
    assert main(["validate", "mine.yaml"]) == 0
    assert capsys.readouterr() == ("mine.yaml: ok, 3 robots, ideal plant, 20 s\n", "")
    assert main(["run", "mine.yaml", "--json", "--duration", "2"]) == 0
    assert json.loads(capsys.readouterr().out)["outcome"] == "unfinished"


def test_new_replaces_no_file_unless_forced(capsys):
    Path("mine.yaml").write_text("mine")
    assert main(["new", "mine.yaml"]) == 2
    assert capsys.readouterr().err == "error: mine.yaml: is there already; allowed: a new name, or --force\n"
    assert Path("mine.yaml").read_text() == "mine"
    assert main(["new", "mine.yaml", "--force"]) == 0
    assert Path("mine.yaml").read_text() == pbrg.template()
    assert main(["new", "nowhere/mine.yaml"]) == 2
    assert "nowhere/mine.yaml: cannot write here" in capsys.readouterr().err


def test_schema_is_printed_or_written_and_the_same(capsys):
    assert main(["schema"]) == 0
    printed = capsys.readouterr().out
    assert main(["schema", "-o", "a.json"]) == 0
    assert Path("a.json").read_text(encoding="utf-8") == printed
    assert json.loads(printed) == pbrg.schema()


def test_the_schema_of_datagrams_is_printed_or_written_and_the_same(capsys):
    assert main(["schema", "--datagrams"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith('syntax = "proto3";') and "message Datagram {" in printed
    assert main(["schema", "--datagrams", "-o", "datagram.proto"]) == 0
    assert Path("datagram.proto").read_text(encoding="utf-8") == printed
    assert main(["schema", "--datagrams", "--family"]) == 2
    told = "error: --family and --datagrams do not go together; allowed: one of them\n"
    assert capsys.readouterr() == ("", told)


def completed(shell, words, **environment):
    """What the shell is offered for the words typed so far."""
    variables = {"_PBRG_COMPLETE": f"complete_{shell}", **environment}
    command = [sys.executable, "-c", "from pbrg_mj.cli.main import main; main()"]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)} | variables, capture_output=True, text=True, check=False
    )
    assert done.stderr == "", words
    return done.stdout


@pytest.mark.parametrize(
    ("shell", "variables"),
    [
        ("bash", {"COMP_WORDS": "pbrg run paper/sim", "COMP_CWORD": "2"}),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "pbrg run paper/sim"}),
        ("fish", {"_TYPER_COMPLETE_ARGS": "pbrg run paper/sim", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}),
    ],
)
def test_shells_complete_bundled_names(shell, variables):
    offered = completed(shell, "pbrg run paper/sim", **variables)
    assert "paper/simulation_near" in offered and "paper/simulation_inadmissible" in offered
    assert "paper/experiment_near" not in offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_for_the_shell_is_printed(shell):
    code = f"import shellingham; shellingham.detect_shell = lambda: ('{shell}', ''); "
    code += "from pbrg_mj.cli.main import main; main(['--show-completion'])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert "_PBRG_COMPLETE=complete_" + shell in done.stdout
    assert (done.returncode, done.stderr) == (0, "")


def test_the_package_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "pbrg_mj", "--version"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, f"pbrg {pbrg.__version__}\n")
