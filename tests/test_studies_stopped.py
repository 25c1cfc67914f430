"""Studies whose process is killed or told to stop: nobody is left behind, and what is finished is not made again.

Everybody who is left holds the pipe of stderr open; that it ends says that nobody is.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.studies.worker import _Watch

# Logs larger than what a pipe holds: whoever hands one over waits until somebody takes it.
STUDY = """\
scenario: paper/simulation_near
seeds: 1-12
duration: 2
logs: true
set: {plant: ideal, reference.solver: none, timing.tick: 0.02}
"""
WORKER = """\
import os, sys, time
from pbrg_mj.studies.worker import become_worker
become_worker(os.getppid(), sys.argv[1])
os.kill(os.getpid(), 2), os.kill(os.getpid(), 15), os.kill(os.getpid(), 1)
print("there", flush=True)
time.sleep(600)
"""
PARENT = f"""\
import subprocess, sys
subprocess.run([sys.executable, "-c", {WORKER!r}, sys.argv[1]])
"""


def test_a_worker_takes_no_signals_and_ends_with_its_killed_parent(tmp_path: Path) -> None:
    place = tmp_path / "place"
    place.mkdir()
    (place / "run.mcap").write_bytes(b"part of a log")
    with subprocess.Popen([sys.executable, "-c", PARENT, str(place)], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"there\n"
        parent.kill()
        assert parent.stdout.read() == b""  # until the worker is gone, too
    assert not place.exists()


def test_who_makes_its_runs_itself_is_no_worker() -> None:
    from pbrg_mj.studies.worker import become_worker

    before = [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    become_worker(os.getpid())
    assert [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)] == before


def finished(folder: Path) -> list[bytes]:
    """Return the lines of finished runs that are whole."""
    file = folder / "runs.jsonl"
    return file.read_bytes().splitlines(keepends=True)[1:] if file.exists() else []


def stopped(folder: Path, number: int, *, whole_group: bool) -> tuple[int, str]:
    """Stop a sweep of two jobs after two runs; return its exit code and what it said once nobody is left."""
    (folder / "given.yaml").write_text(STUDY)
    (folder / "tmp").mkdir()
    program = "import sys; from pbrg_mj.cli.main import main; sys.exit(main())"
    command = [sys.executable, "-c", program, "sweep", "given.yaml", "-o", "out", "--jobs", "2"]
    with subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "TMPDIR": str(folder / "tmp")},
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as parent:
        while len(finished(folder / "out")) < 2 and parent.poll() is None:
            time.sleep(0.02)
        (os.killpg if whole_group else os.kill)(parent.pid, number)
        assert parent.stderr is not None
        said = parent.stderr.read()
        code = parent.wait()
    return code, said


@pytest.mark.slow
def test_a_killed_sweep_leaves_nobody_and_goes_on_where_it_was(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    code, _ = stopped(tmp_path, signal.SIGKILL, whole_group=False)
    assert code == -signal.SIGKILL
    assert not list((tmp_path / "tmp").rglob("*"))
    before = finished(tmp_path / "out")
    assert 2 <= len(before) < 12
    assert main(["sweep", str(tmp_path / "given.yaml"), "-o", str(tmp_path / "out"), "--jobs", "1"]) == 0
    capsys.readouterr()
    after = finished(tmp_path / "out")
    assert after[: len(before)] == before
    assert len({json.loads(line)["run"] for line in after}) == len(after) == 12
    assert len(list((tmp_path / "out" / "logs").iterdir())) == 12


@pytest.mark.slow
@pytest.mark.parametrize(("number", "whole_group"), [(signal.SIGTERM, False), (signal.SIGHUP, True)])
def test_a_sweep_that_is_told_to_stop_says_what_is_finished(number: int, whole_group: bool, tmp_path: Path) -> None:
    """The whole group is told where a terminal closes or `timeout` ends a command."""
    code, said = stopped(tmp_path, number, whole_group=whole_group)
    assert code == 128 + number
    (line,) = said.splitlines()
    assert line.startswith("interrupted; out has ")
    assert not list((tmp_path / "tmp").rglob("*"))


def test_a_worker_that_is_ending_makes_no_folder_any_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its runs go on in their own thread until the process is gone."""
    removed, over = threading.Event(), threading.Event()
    monkeypatch.setattr("pbrg_mj.studies.worker.os._exit", lambda code: (removed.set(), over.wait()))
    watch = _Watch(parent=-1)  # nobody's
    watch.make(tmp_path / "place")
    (tmp_path / "place" / "file").touch()
    watch.start()
    assert removed.wait(60) and not (tmp_path / "place").exists()
    run = threading.Thread(target=watch.make, args=(tmp_path / "place",), daemon=True)
    run.start()
    run.join(0.5)
    assert run.is_alive() and not (tmp_path / "place").exists()
    over.set()
    run.join()


def test_what_a_run_makes_while_its_folder_is_removed_goes_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    removed, remove, place = threading.Event(), shutil.rmtree, tmp_path / "place"
    monkeypatch.setattr("pbrg_mj.studies.worker.os._exit", lambda code: removed.set())
    late = iter([place / "first", place / "second"])

    def while_a_run_writes(folder: Path, ignore_errors: bool) -> None:
        if one := next(late, None):
            one.touch()
        else:
            remove(folder, ignore_errors)

    monkeypatch.setattr("pbrg_mj.studies.worker.shutil.rmtree", while_a_run_writes)
    watch = _Watch(parent=-1)
    watch.make(place)
    watch.start()
    assert removed.wait(60) and not place.exists()
