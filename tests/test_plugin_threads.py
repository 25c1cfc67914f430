"""A thread of a plug-in that fails in another process: one line of the command's own, and exit code 1."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main

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


def test_in_a_robots_process_it_is_one_line(installed, tmp_path, capfd):
    arguments = ["paper/simulation_near", "--duration", "0.1", "--set", "governor.kind=threaded", "--processes"]
    assert main(["run", *arguments, "-o", str(tmp_path / "a.mcap"), "--quiet"]) == 1
    said = capfd.readouterr().err.splitlines(keepends=True)
    assert said.count(SAYS) == 1 and not [line for line in said if "Traceback" in line or "Thread-" in line]
    assert pbrg.open(tmp_path / "a.mcap").metrics.duration_s == pytest.approx(0.1)
