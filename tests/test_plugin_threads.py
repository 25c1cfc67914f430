"""A thread of a plug-in that fails in another process: one line of the command's own, and exit code 1."""

from __future__ import annotations

import re
import sys
import threading
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.plugin_failures import note_call, take_thread_failure
from pbrg_mj.studies import worker
from tests.needs import need_module

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "write-a-robot-program.md"
FAILING = """
    def finish(self, memory):
        import threading

        def fail():
            raise ValueError("in a thread \\u2460")

        thread = threading.Thread(target=fail)
        thread.start()
        thread.join()
"""
SWEEP = """\
scenario: paper/simulation_near
seeds: {seeds}
duration: 0.1
set: {{reference.solver: none, governor.kind: threaded}}
"""
SUITE = """\
scenario: [paper/simulation_near]
train: 1-2
held_out: 3-4
duration: 0.1
set: {reference.solver: none}
governors: {threaded: {settings: {governor.kind: threaded}, networks: [perfect], tuning: none}}
networks: {perfect: {}}
"""
SAYS = "error: threaded: the robot program raised ValueError in a thread of its own: in a thread \u2460\n"


@pytest.fixture
def installed(tmp_path_factory, monkeypatch):
    """The page's robot program, with a thread that fails in every tick, where processes find it, too."""
    site = tmp_path_factory.mktemp("site")
    text = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL).group(1)
    (site / "their_threads.py").write_text(text.replace("    def finish(self, memory):\n", FAILING.lstrip("\n")))
    info = site / "their_threads-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-threads\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[pbrg_mj.robot_programs]\nthreaded = their_threads:build\n")
    get_reusable_executor().shutdown(wait=True)  # processes that are there already would not find it
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setenv("PYTHONPATH", ":".join([str(site), *sys.path]))
    yield
    sys.modules.pop("their_threads", None)


@pytest.mark.parametrize(("runs", "jobs"), [(2, 1), (4, 2)])
def test_in_a_study_it_is_one_line_wherever_the_runs_are_made(runs, jobs, installed, tmp_path, capfd):
    (tmp_path / "given.yaml").write_text(SWEEP.format(seeds=f"1-{runs}"))
    assert main(["sweep", str(tmp_path / "given.yaml"), "-o", str(tmp_path / "out"), "--jobs", str(jobs)]) == 1
    assert capfd.readouterr().err == SAYS
    assert len((tmp_path / "out" / "runs.jsonl").read_text().splitlines()) == 1 + runs


@pytest.mark.parametrize("jobs", [1, 2])
def test_where_a_benchmark_is_verified_it_is_one_line(jobs, installed, tmp_path, capfd):
    (tmp_path / "given.yaml").write_text(SUITE)
    folder = str(tmp_path / "out")
    for arguments in (
        [str(tmp_path / "given.yaml"), "-o", folder, "--jobs", "1"],
        ["--verify", folder, "--jobs", str(jobs)],
    ):
        assert main(["bench", *arguments]) == 1
        said = [line for line in capfd.readouterr().err.splitlines() if not line.startswith("written: ")]
        assert len(said) == 1 and said[0].startswith("error: threaded: the robot program")
        assert said[0].endswith("raised ValueError in a thread of its own: in a thread \u2460")


@pytest.mark.slow
@pytest.mark.parametrize(("workers", "threads"), [(2, 1), (1, 2)])
def test_in_a_worker_of_dask_it_is_one_line(workers, threads, installed, tmp_path, capfd):
    """Also where runs share a process, and in a second study of the same workers; a study without one has none."""
    distributed = need_module("distributed")
    (tmp_path / "given.yaml").write_text(SWEEP.format(seeds="1-3"))
    (tmp_path / "plain.yaml").write_text(SWEEP.format(seeds="1-3").replace("threaded", "certified"))
    options = {"n_workers": workers, "threads_per_worker": threads, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        dask = ["--backend", "dask", "--scheduler", cluster.scheduler_address]
        for file, out, code in [("given", "out", 1), ("plain", "none", 0), ("given", "again", 1)]:
            assert main(["sweep", str(tmp_path / f"{file}.yaml"), "-o", str(tmp_path / out), *dask]) == code
            assert capfd.readouterr().err == (SAYS if code else "")
            assert len((tmp_path / out / "runs.jsonl").read_text().splitlines()) == 1 + 3


def test_in_a_robots_process_it_is_one_line(installed, tmp_path, capfd):
    arguments = ["paper/simulation_near", "--duration", "0.1", "--set", "governor.kind=threaded", "--processes"]
    assert main(["run", *arguments, "-o", str(tmp_path / "a.mcap"), "--quiet"]) == 1
    said = capfd.readouterr().err.splitlines(keepends=True)
    assert said.count(SAYS) == 1 and not [line for line in said if "Traceback" in line or "Thread-" in line]
    assert pbrg.open(tmp_path / "a.mcap").metrics.duration_s == pytest.approx(0.1)


@pytest.fixture
def hearing(monkeypatch):
    """A process that works for another one begins to hear threads, over a hook that takes down what is passed on."""
    passed_on = []
    monkeypatch.setattr(threading, "excepthook", lambda hook: passed_on.append(str(hook.exc_value)))
    worker._hear_threads.cache_clear()
    yield passed_on
    worker._hear_threads.cache_clear()


def failing_thread(text):
    def fail():
        raise ValueError(text)

    thread = threading.Thread(target=fail)
    thread.start()
    thread.join()


def test_runs_that_share_a_process_are_each_told_the_first_failure_and_a_late_one_is_a_line(hearing, capsys):
    said = "mine: the governor raised ValueError in a thread of its own: {}"
    with worker.catch_thread_failures() as first:
        note_call("mine", "governor")
        with worker.catch_thread_failures() as second:
            failing_thread("one")
        failing_thread("two")
    assert first == second == [said.format("one")]
    failing_thread("late")
    assert capsys.readouterr().err == f"error: {said.format('late')}\n"
    with worker.catch_thread_failures() as third:  # nobody's any more
        failing_thread("three")
    assert third == [] and hearing == ["three"]


def test_what_another_process_told_is_not_kept_again(hearing):
    with worker.catch_thread_failures() as kept:
        take_thread_failure("theirs: the governor")
    assert kept == [] and hearing == ["theirs: the governor"]
