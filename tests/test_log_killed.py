"""kill -9 at random moments of a running `pbrg run`: the log loses a second at most, and replays to its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.log.reader import read_run
from pbrg_mj.log.verify import verify

ROOT = Path(__file__).parents[1]
KILLS = int(os.environ.get("PBRG_KILLS", "5"))
LOST = 1.0  # [s] of wall clock, at most


def run_and_kill(log: Path, after: float) -> float:
    """Start a run, kill it `after` seconds from its log's first byte; return the wall clock then."""
    command = [sys.executable, "-m", "pbrg_mj.cli.main", "run", "paper/experiment_near", "-o", str(log), "--quiet"]
    with subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)}) as process:
        deadline = time.monotonic() + 300  # a first run compiles its kernels
        while not (log.exists() and log.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(after)
        process.send_signal(signal.SIGKILL)
        killed = time.time()
        assert process.wait() == -signal.SIGKILL
    return killed


@pytest.mark.slow
def test_a_killed_run_loses_at_most_a_second_and_replays(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    for number in range(KILLS):
        log = tmp_path / f"killed_{number}.mcap"
        killed = run_and_kill(log, float(rng.uniform(0.5, 3.0)))
        # The file's last change is its last whole chunk: what came after is lost.
        assert killed - log.stat().st_mtime < LOST
        run = read_run(log)
        assert run.damage in ("the file ends before its end mark", "the file ends inside a record")
        found = verify(log)
        assert (found.first, found.ticks, found.damage) == (None, len(run.ticks.time), run.damage)
        log.unlink()
