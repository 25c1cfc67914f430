"""kill -9 at random moments of a running `pbrg run`: the log loses a second at most, and replays to its end.

It then has the name it had while it was written.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.verify.replay import verify
from pbrg_mj.log.write.log_file import partial_path

ROOT = Path(__file__).parents[1]
PARTS, KILLS = 10, 5  # fifty in all
LOST = 1.0  # [s] of wall clock, at most


def start(log: Path, duration: float) -> subprocess.Popen[bytes]:
    run = ("run", "paper/experiment_near", "--duration", str(duration), "-o", str(log), "--quiet")
    command = [sys.executable, "-m", "pbrg_mj.cli.main", *run]
    return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)})


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A first run stops for seconds to compile a kernel; it is not the runs to be killed that do."""
    assert start(tmp_path_factory.mktemp("first") / "first.mcap", 2.0).wait() == 0


def run_and_kill(log: Path, after: float) -> float:
    """Start a run, kill it `after` seconds from its log's first byte; return the wall clock then."""
    partial = partial_path(log)
    with start(log, 900.0) as process:  # long, so that no run ends before it is killed
        deadline = time.monotonic() + 60
        while not (partial.exists() and partial.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(after)
        process.send_signal(signal.SIGKILL)
        killed = time.time()
        assert process.wait() == -signal.SIGKILL
    return killed


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_a_killed_run_loses_at_most_a_second_and_replays(tmp_path: Path, part: int) -> None:
    rng = np.random.default_rng((9, part))
    for number in range(KILLS):
        wanted = tmp_path / f"killed_{number}.mcap"
        killed = run_and_kill(wanted, float(rng.uniform(0.5, 3.0)))
        assert not wanted.exists()
        log = partial_path(wanted)
        # The file's last change is its last whole chunk: what came after is lost.
        assert killed - log.stat().st_mtime < LOST
        run = open_run(log)
        assert run.damage in ("the file ends before its end mark", "the file ends inside a record")
        assert run.how_it_ended == "not said (killed?)"
        found = verify(log)
        assert (found.first, found.ticks, found.damage) == (None, len(run.ticks.time), run.damage)
        log.unlink()
