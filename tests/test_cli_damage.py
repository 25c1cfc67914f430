"""Every command that reads logs, given logs that had accidents: a line on stderr, never a traceback.

`compare` and `repair` are given every accident: between them they have the readers of all commands. What the other
commands do depends on what those found, so they are given one accident of each finding. All commands were given all
accidents in every run of the slow tests before this was so; `python -m scripts.fuzz logs` has more of them by seed.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.video import render
from pbrg_mj.video.gl import working_backend
from tests.needs import need, need_module
from tests.test_log_damage import corrupt

need_module("matplotlib")
need_module("av")
READERS = {"compare": [], "repair": ["-o", "out.mcap"]}
# One of each kind of output.
OTHERS = {
    "replay": [],
    "export": ["-o", "out.csv"],
    "report": ["-o", "out.html"],
    "replay --verify": [],
}
# Drawn is one finding of so many: that takes longer.
DRAWN = {
    "plot": (4, ["-o", "out.svg", "--panels", "gap,margin"]),
    "render": (10, ["-o", "out.png", "--size", "64x64"]),
}
ACCIDENTS, PARTS = 2000, 4


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Six tenths of a second of the paper's experiment: three chunks, scans, half-spaces."""
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    assert main(["run", "paper/experiment_near", "--duration", "0.6", "--quiet", "-o", str(path)]) == 0
    return path.read_bytes()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def backend(monkeypatch: pytest.MonkeyPatch) -> None:
    """Probe once for all pictures."""
    try:
        found = working_backend()
    except InputError as error:
        need(False, str(error))
    else:
        monkeypatch.setattr(render, "working_backend", lambda: found)


def told(command: str, options: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Run a command on accident.mcap: it says lines, and leaves a whole file or none.

    Return its exit code and what it said and printed.
    """
    code = main([*command.split(), "accident.mcap", *options])
    printed = capsys.readouterr()
    said = printed.err.splitlines()
    assert all(line.startswith(("error: ", "warning: ")) for line in said), (command, said)
    errors = [line for line in said if line.startswith("error: ")]
    assert (code, len(errors)) in ((0, 0), (1, 0), (2, 1)), (command, code, said)
    assert len(said) <= 2, (command, said)
    for path in Path.cwd().glob("out.*"):
        assert code == 0, (command, code)
        path.unlink()
    assert [path.name for path in Path.cwd().iterdir()] == ["accident.mcap"]
    return code, printed.err + printed.out


def others(finding: int) -> dict[str, list[str]]:
    """Return the commands, with their options, that the first accident of the finding of that number is given to."""
    return OTHERS | {name: options for name, (share, options) in DRAWN.items() if finding % share == 0}


def survive(whole: bytes, numbers: range, folder: Path, capsys: pytest.CaptureFixture[str]) -> Counter[tuple[str, int]]:
    """Let accidents happen and return how often each command ended with which code."""
    codes: Counter[tuple[str, int]] = Counter()
    findings: set[tuple[str, ...]] = set()
    for number in numbers:
        rng = np.random.default_rng((2017, number))
        accident = corrupt(whole, rng)
        if number % 3 == 0:
            accident = corrupt(accident, rng)
        (folder / "accident.mcap").write_bytes(accident)
        found = {command: told(command, options, capsys) for command, options in READERS.items()}
        finding = tuple(text for _, text in found.values())
        if finding not in findings:
            found |= {name: told(name, options, capsys) for name, options in others(len(findings)).items()}
            findings.add(finding)
        codes.update((command, code) for command, (code, _) in found.items())
    return codes


@pytest.mark.usefixtures("backend")
def test_a_few_accidents(whole: bytes, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    codes = survive(whole, range(6), folder, capsys)
    assert codes["render", 0] + codes["render", 2] == 1
    assert codes["compare", 0] > 0


@pytest.mark.slow
@pytest.mark.usefixtures("backend")
@pytest.mark.parametrize("part", range(PARTS))
def test_two_thousand_accidents(whole: bytes, folder: Path, capsys: pytest.CaptureFixture[str], part: int) -> None:
    share = ACCIDENTS // PARTS
    codes = survive(whole, range(part * share, (part + 1) * share), folder, capsys)
    for command in READERS:
        assert codes[command, 0] + codes[command, 2] == share
        assert codes[command, 0] > 0.2 * share and codes[command, 2] > 0.02 * share, codes
    for command in OTHERS:
        assert codes[command, 0] >= 5 and codes[command, 2] >= 3, codes
