"""What a user got wrong is told before anything slow: none of these command lines imports the simulator's libraries."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

RUN, BATCH = ("run", "paper/experiment_near"), ("batch", "paper/experiment_near")
WRONG = {
    ("run", "paper/experiment_near", "--duration", "0.1", "--output", "r"): "r: a log's name ends in .mcap",
    (*RUN, "-o", "there.mcap"): "there.mcap: exists; --force",
    (*RUN, "-o", "nowhere/r.mcap"): "cannot write nowhere/r.mcap: there is no folder nowhere",
    (*RUN, "--seed", "-1"): "--seed is -1; allowed: a whole number at least 0 and less than 9223372036854775808",
    ("robot", "paper/experiment_near", "1", "--connect", "localhost:1", "--seed", "-1"): "--seed is -1; allowed: ",
    ("draw", "families/boxes", "--seed", str(2**63)): f"--seed is {2**63}; allowed: ",
    ("run", "paper/nosuch"): "'paper/nosuch' is neither a file nor a bundled scenario; ",
    ("batch", "paper/nosuch"): "'paper/nosuch' is neither a file nor a bundled scenario; ",
    ("validate", "paper/nosuch"): "'paper/nosuch' is neither a file nor a bundled scenario; ",
    ("show", "nosuch"): "'nosuch' is neither a file nor a bundled scenario; ",
    ("reproduce", "-o", "full"): "full/experiment_near.mcap: exists; --force",
    ("reproduce", "-o", "there.npz"): "there.npz: this is not a folder",
    (*RUN, "--pace", "-1"): "--pace is -1",
    (*BATCH, "--seeds", "x"): "--seeds is 'x'",
    (*BATCH, "-o", "r.txt"): "r.txt: the name ends in '.txt'; allowed: .npz",
    (*BATCH, "-o", "there.npz"): "there.npz: exists; --force",
    ("compare", "there.mcap", "nosuch.mcap"): "nosuch.mcap: there is no such file",
    ("export", "nosuch.mcap", "-o", "r.npz"): "nosuch.mcap: there is no such file",
    ("plot", "nosuch.mcap", "-o", "r.png"): "nosuch.mcap: there is no such file",
    ("render", "there.mcap", "-o", "r.avi"): "r.avi: the name ends in '.avi'; allowed: .mp4, .webm, .gif, .webp, .png",
    ("render", "nosuch.mcap", "-o", "r.mp4"): "nosuch.mcap: there is no such file",
    ("report", "nosuch.mcap", "-o", "r.html"): "nosuch.mcap: there is no such file",
    ("export", "there.mcap", "-o", "r.xlsx"): "r.xlsx: the name ends in '.xlsx'; allowed: .npz, .mat, .csv",
    ("plot", "there.mcap", "-o", "r.gif"): "r.gif: the name ends in '.gif'; allowed: .pdf, .png, .svg",
    ("report", "there.mcap", "-o", "r.txt"): "r.txt: the name ends in '.txt'; allowed: .html, .htm",
    ("export", "there.mcap", "-o", "folder.csv"): "folder.csv: cannot write: Is a directory",
    ("plot", "there.mcap", "-o", "folder.svg"): "folder.svg: cannot write: Is a directory",
    ("report", "there.mcap", "-o", "folder.html"): "folder.html: cannot write: Is a directory",
    ("export", "there.mcap", "-o", "there.npz"): "there.npz: exists; --force overwrites it",
    ("plot", "there.mcap", "-o", "there.svg"): "there.svg: exists; --force overwrites it",
    ("render", "there.mcap", "-o", "there.mp4"): "there.mp4: exists; --force overwrites it",
    ("report", "there.mcap", "-o", "there.html"): "there.html: exists; --force overwrites it",
    ("schema", "-o", "there.json"): "there.json: exists; --force overwrites it",
    ("replay", "nosuch.mcap", "--verify"): "nosuch.mcap: there is no such file",
    ("repair", "nosuch.mcap", "-o", "r.mcap"): "nosuch.mcap: there is no such file",
    ("sweep", "nosuch.yaml", "-o", "r"): "nosuch.yaml: is not there",
    ("tune", "nosuch.yaml", "-o", "r"): "nosuch.yaml: is not there",
    ("falsify", "paper/experiment_near", "--search", "nosuch.yaml", "-o", "r"): "nosuch.yaml: is not there",
}
SLOW = ("numpy", "scipy", "numba", "mujoco", "mcap", "cvxpy")
CODE = f"""
import contextlib, io, json, sys
sys.modules.update(dict.fromkeys({SLOW!r}))  # each import of one raises ImportError
from pbrg_mj.cli.main import main
told = []
for arguments in json.load(sys.stdin):
    with contextlib.redirect_stderr(io.StringIO()) as errors:
        told.append((main(arguments), errors.getvalue()))
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory) -> dict[tuple[str, ...], tuple[int, str]]:
    folder = tmp_path_factory.mktemp("early")
    (folder / "full").mkdir()
    there = {f"there.{suffix}" for suffix in ("mcap", "npz", "svg", "mp4", "html", "json")}
    for name in (*there, "full/experiment_near.mcap"):
        (folder / name).touch()
    folders = {f"folder.{suffix}" for suffix in ("csv", "svg", "html")}
    for name in folders:
        (folder / name).mkdir()
    given = json.dumps([list(arguments) for arguments in WRONG])
    done = subprocess.run(
        [sys.executable, "-c", CODE], input=given, capture_output=True, text=True, check=True, cwd=folder
    )
    assert {path.name for path in folder.iterdir()} == {*there, "full", *folders}
    return {arguments: tuple(one) for arguments, one in zip(WRONG, json.loads(done.stdout), strict=True)}


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_what_is_wrong_is_told_before_anything_slow_is_imported(told, arguments):
    code, errors = told[arguments]
    assert errors.startswith(f"error: {WRONG[arguments]}")
    assert errors.count("\n") == 1
    assert code == 2


def test_a_scenario_is_checked_before_the_simulator_is_imported(tmp_path):
    code = (
        "import sys; sys.modules['mujoco'] = None; from pbrg_mj.cli.main import main; "
        "assert main(['run', 'paper/experiment_near', '--seed', '-1']) == 2; "
        "assert main(['run', 'paper/nosuch']) == 2"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, cwd=tmp_path)


def test_the_names_that_are_checked_early_are_those_that_are_written():
    from pbrg_mj.analysis import export
    from pbrg_mj.analysis.figures import figure
    from pbrg_mj.analysis.metrics import paper_table
    from pbrg_mj.analysis.report import page
    from pbrg_mj.api import files
    from pbrg_mj.video import encode

    assert tuple(export.WRITERS) == files.ARRAYS
    assert tuple(figure.METADATA) == files.FIGURES
    assert tuple(page.SUFFIXES) == files.PAGES
    assert encode.SUFFIXES == files.PICTURES
    assert paper_table.RUNS == files.PAPER
