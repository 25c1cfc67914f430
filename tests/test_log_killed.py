"""kill -9 at random moments of a running `pbrg run`: what was on the disk stays whole, and replays to its end.

It then has the name it had while it was written. That no more than a chunk waits is test_log_waiting.py's; how
many seconds that is on a clock is measured by `python -m scripts.fuzz`.
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
PARTS, KILLS = 4, 4  # `python -m scripts.fuzz kills` has more, in forks, which need not import everything each
SIZES = 100e3, 300e3  # [bytes] of the log at which runs are killed, from and to


def start(log: Path, duration: float) -> subprocess.Popen[bytes]:
    run = ("run", "paper/experiment_near", "--duration", str(duration), "-o", str(log), "--quiet")
    command = [sys.executable, "-m", "pbrg_mj.cli.main", *run]
    return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)})


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A first run stops for seconds to compile a kernel; it is not the runs to be killed that do."""
    assert start(tmp_path_factory.mktemp("first") / "first.mcap", 2.0).wait() == 0


def run_and_kill(log: Path, size: float) -> int:
    """Start a run, kill it when its log has grown to so many bytes; return how many ticks were in them."""
    partial = partial_path(log)
    with start(log, 900.0) as process:  # long, so that no run ends before it is killed
        while not (partial.exists() and partial.stat().st_size >= size):
            assert process.poll() is None
            time.sleep(0.01)
        before = partial.read_bytes()
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    copy = log.with_name("before.mcap")
    copy.write_bytes(before)
    return len(open_run(copy).ticks.time)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_a_killed_run_keeps_what_was_on_the_disk_and_replays(tmp_path: Path, part: int) -> None:
    rng = np.random.default_rng((9, part))
    for number in range(KILLS):
        wanted = tmp_path / f"killed_{number}.mcap"
        before = run_and_kill(wanted, rng.uniform(*SIZES))
        assert not wanted.exists()
        log = partial_path(wanted)
        run = open_run(log)
        assert len(run.ticks.time) >= before > 0
        assert run.damage in ("the file ends before its end mark", "the file ends inside a record")
        assert run.ending_text == "not said (killed?)"
        found = verify(log)
        assert (found.first, found.ticks, found.damage) == (None, len(run.ticks.time), run.damage)
        log.unlink()
