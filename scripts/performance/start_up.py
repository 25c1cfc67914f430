"""How long commands take to start, and whether memory stays flat."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from statistics import median

from pbrg_mj.api.garbage_collection import settle
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from performance.closed_loop import SCENARIO
from performance.timing import REPEATS, seconds

MINUTES = 10
SETTLED = 10.0  # simulated time after which memory is to stay flat [s]
PAGE = os.sysconf("SC_PAGE_SIZE")


def starts() -> dict[str, float]:
    """Return the wall-clock times of `pbrg --help`, and of a run of one simulated second, kernels cached [s]."""
    with tempfile.TemporaryDirectory() as folder:
        run = ["run", SCENARIO, "--duration", "1", "--quiet", "--force", "-o", str(Path(folder) / "run.mcap")]
        return {"help_s": _median(["--help"]), "first_simulated_second_s": _median(run)}


def _median(arguments: list[str]) -> float:
    command = [sys.executable, "-m", "pbrg_mj.cli.main", *arguments]

    cached = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

    def call() -> None:
        subprocess.run(command, check=True, capture_output=True, env=cached)

    call()
    return median(seconds(call) for _ in range(REPEATS))


def memory_growth() -> dict[str, float]:
    """Return how much a run of ten minutes, logged, grows after its first ten seconds, and what it holds [MB]."""
    # A new process has nothing left over that growth could hide in.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_memory_growth).result()


def _memory_growth() -> dict[str, float]:
    settle()  # as `pbrg run` does
    loaded = load_scenario(SCENARIO, [f"timing.duration={60 * MINUTES}"])
    simulation = Simulation.build(loaded.scenario)
    settled, largest = 0.0, 0.0
    with (
        tempfile.TemporaryDirectory() as folder,
        LogWriter(Path(folder) / "run.mcap", loaded, simulation.model_xml) as write,
    ):
        for record in simulation.records():
            write(record)
            if record.index % 100 == 0:
                held = _resident()
                settled = held if record.time <= SETTLED else settled
                largest = max(largest, held)
    return {"memory_growth_mb": (largest - settled) / 1e6, "memory_mb": largest / 1e6}


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE
