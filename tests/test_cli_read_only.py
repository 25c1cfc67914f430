"""A folder that may not be written into: one line, exit code 2, nothing half-written, whichever command was to write.

Root may write anywhere, so that for root the commands run as a user without rights.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from pbrg_mj.cli.main import main
from scripts.fuzz.sandbox import Ending, run_apart
from tests.needs import need_module

LOG = Path(__file__).parent / "data" / "version_0_1_0.mcap"
NOBODY = 65534
SHORT = ("paper/experiment_near", "--duration", "0.02")
COMMANDS = {
    "run": ("run", *SHORT, "-o", "{}/new.mcap"),
    "run --force": ("run", *SHORT, "--force", "-o", "{}/there.mcap"),
    "batch": ("batch", *SHORT, "--seeds", "1-2", "-o", "{}/new.npz"),
    "reproduce": ("reproduce", "--duration", "0.1", "-o", "{}/paper"),
    "reproduce, there": ("reproduce", "--duration", "0.1", "-o", "{}"),
    "plot": ("plot", str(LOG), "-o", "{}/new.svg"),
    "render, still": ("render", str(LOG), "-o", "{}/new.png"),
    "render, video": ("render", str(LOG), "-o", "{}/new.mp4"),
    "report": ("report", str(LOG), "-o", "{}/new.html"),
    "report, there": ("report", str(LOG), "--force", "-o", "{}/there.html"),
    "export": ("export", str(LOG), "-o", "{}/new.npz"),
    "repair": ("repair", str(LOG), "-o", "{}/new.mcap"),
    "new": ("new", "{}/new.yaml"),
    "schema": ("schema", "-o", "{}/new.json"),
    "sweep": ("sweep", "sweep.yaml", "-o", "{}/new"),
    "sweep, there": ("sweep", "sweep.yaml", "-o", "{}"),
    "tune": ("tune", "tune.yaml", "-o", "{}/new"),
    "bench": ("bench", "suite.yaml", "-o", "{}/new"),
    "bench, there": ("bench", "suite.yaml", "-o", "{}", "--force"),
    "falsify": ("falsify", SHORT[0], "--search", "search.yaml", "-o", "{}/new"),
}
STUDIES = {
    "sweep.yaml": f"scenario: {SHORT[0]}",
    "tune.yaml": f"scenario: {SHORT[0]}\nkeys: {{control.alpha_r: {{uniform: [0.5, 3]}}}}",
    "suite.yaml": f"scenario: [{SHORT[0]}]\ntrain: 1\nheld_out: 2\n"
    "governors: {none: {settings: {}, tuning: none}}",
    "search.yaml": "find: contact\nkeys: {control.alpha_r: {uniform: [0.5, 3]}}",
}
SEARCHES = ("tune", "falsify")


@pytest.fixture
def locked() -> Iterator[Path]:
    """A folder that everybody may read: with a log, a page, studies' files, and no leave to write."""
    folder = Path(tempfile.mkdtemp(prefix="locked-"))  # pytest's own folders are closed to others
    for name in ("there.mcap", "there.html"):
        (folder / name).write_bytes(LOG.read_bytes())
    for name, text in STUDIES.items():
        (folder / name).write_text(text)
    folder.chmod(0o555)
    yield folder
    folder.chmod(0o755)
    shutil.rmtree(folder)


def without_rights(arguments: list[str]) -> Ending:
    """Run a command in a fork of this process that has given up its rights."""

    def command() -> int:
        if os.geteuid() == 0:
            os.setgroups([])
            os.setresgid(NOBODY, NOBODY, NOBODY)
            os.setresuid(NOBODY, NOBODY, NOBODY)
        return main(arguments)

    return run_apart(command)


@pytest.mark.parametrize("name", COMMANDS)
def test_what_may_not_be_written_is_one_line(name: str, locked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in SEARCHES:
        need_module("optuna")
    monkeypatch.chdir(locked)
    before = {path.name: path.read_bytes() for path in locked.iterdir()}
    # In a place that is no folder it ends as early: what it imports until then a user without rights need not read.
    assert main([part.format(f"{locked}/there.html") for part in COMMANDS[name]]) == 2
    ended = without_rights([part.format(locked) for part in COMMANDS[name]])
    assert (ended.code, ended.stdout) == (2, ""), ended.stderr
    (line,) = ended.stderr.splitlines()
    assert line.startswith("error: ")
    assert str(locked) in line
    assert "ermission denied" in line
    assert {path.name: path.read_bytes() for path in locked.iterdir()} == before
