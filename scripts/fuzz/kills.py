"""A run is killed at a random moment, and its log read: less than a second of simulated time may be lost."""

from __future__ import annotations

import contextlib
import mmap
import os
import signal
import struct
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.api import simulate
from pbrg_mj.cli.main import main
from scripts.fuzz.sandbox import run_apart
from scripts.fuzz.values import pick
from scripts.fuzz.verdict import Failure, fault

LOG = "killed.mcap"
SCENARIOS = ("paper/experiment_near", "paper/simulation_inadmissible", "network/lossy", "scale/eight_robots")
LONGEST = 2.0  # [s] of wall clock from the first tick to the kill
EARLY = 20  # one run in so many is killed that soon after its start instead, perhaps before its first tick
PATIENCE = 60.0  # [s] for the first tick
FIRST_TICK = 1e-9  # [s] what is told of the tick at 0: it has been seen
LOST = 1.0  # [s] of simulated time, less than which may be lost
VERIFIED = 10  # one log in so many is simulated again and compared


def warm_up() -> None:
    """Import all, and compile or load the kernels, before the processes part."""
    for name in SCENARIOS:
        main(["run", name, "--duration", "0.3", "--quiet", "-o", LOG])
        main(["replay", "--verify", LOG])
        Path(LOG).unlink()


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Kill the run of that number in the current folder, empty before and after; yield what went wrong."""
    rng = np.random.default_rng((16, seed))
    name, after = pick(rng, SCENARIOS), float(rng.uniform(0.0, LONGEST))
    command = f"pbrg run {name} -o {LOG} # killed after {after:.2f} s"
    simulated = _run_and_kill(name, after, early=seed % EARLY == 0)
    left = list(Path.cwd().iterdir())
    kept = _last_time(left[0]) if left else None
    lost = simulated - (kept or 0.0)
    codes["killed before the log began" if kept is None else "killed"] += 1
    if seed % EARLY and not simulated:
        yield Failure(seed, "no tick", command, f"none was seen within {PATIENCE:g} s")
    if len(left) > 1 or lost >= LOST:
        yield Failure(seed, "lost", command, f"{lost:.3f} s of {simulated:.3f} s; left: {[one.name for one in left]}")
    if kept is not None:
        verified = [["replay", "--verify", left[0].name]] if seed % VERIFIED == 0 else []
        for reading in [["compare", left[0].name], ["repair", left[0].name, "-o", "repaired.mcap"], *verified]:
            ending = run_apart(lambda reading=reading: main(reading))
            codes[f"{reading[0]} {ending.code}"] += 1
            found = fault(ending) or (("refused", ending.stderr[-300:]) if ending.code == 2 else None)
            if found:
                yield Failure(seed, f"{reading[0]}: {found[0]}", f"{command}; pbrg {' '.join(reading)}", found[1])
    for one in Path.cwd().iterdir():
        one.unlink()


def _run_and_kill(name: str, after: float, *, early: bool) -> float:
    """Return how much had been simulated when the kill came [s]."""
    with mmap.mmap(-1, 8) as shared:
        child = os.fork()
        if not child:
            _run(name, shared)
        deadline = time.monotonic() + PATIENCE
        while not early and shared[:] == bytes(8) and time.monotonic() < deadline:
            time.sleep(0.005)
        time.sleep(after)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return struct.unpack("d", shared[:])[0]


def _run(name: str, shared: mmap.mmap) -> None:
    """Run for long, telling after every tick what time it is."""
    record = simulate.record

    def watched(*arguments, watch=(), **more):
        def tell(tick) -> None:
            shared[:] = struct.pack("d", max(tick.time, FIRST_TICK))

        return record(*arguments, watch=[*watch, tell], **more)

    with contextlib.suppress(BaseException):
        simulate.record = watched
        main(["run", name, "--duration", "900", "--quiet", "-o", LOG])
    os._exit(1)  # it was to be killed


def _last_time(log: Path) -> float | None:
    """Return the time of the last tick that can be read; None where the log holds no whole tick."""
    try:
        return float(pbrg.open(log).time_s[-1])
    except pbrg.InputError:
        return None
