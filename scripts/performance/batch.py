"""Many worlds in a batch against bare mujoco.batch stepping of the same worlds."""

from __future__ import annotations

import os
from statistics import median
from time import perf_counter

import mujoco
import numpy as np
from mujoco import batch

from pbrg_mj.loop.batch import BatchSimulation
from performance.closed_loop import RECOMMENDED, bare_model, recorded_commands, scenario
from performance.timing import REPEATS

WORLDS = 64
DURATION = 1.5  # [s]


def batch_throughput() -> dict[str, float]:
    """Return the throughput of worlds side by side [simulated s per s], and its ratio to bare mujoco.batch.

    The ratio with the paper's governor, and with the recommended set-up.
    """
    threads = os.cpu_count() or 1
    ours, bare, ratio = _throughput(threads)
    return {
        "worlds": WORLDS,
        "threads": threads,
        "worlds_over_bare_batch": ratio,
        "recommended_worlds_over_bare_batch": _throughput(threads, *RECOMMENDED)[2],
        "worlds_simulated_s_per_s": ours,
        "bare_batch_simulated_s_per_s": bare,
    }


def _throughput(threads: int, *overrides: str) -> tuple[float, float, float]:
    """Return simulated s per s of ours and of bare physics, and how much of it ours reaches."""
    loaded = scenario(f"timing.duration={DURATION}", *overrides)
    plan = loaded.scenario
    model, voltages = bare_model(loaded), recorded_commands(loaded)
    substeps = round(plan.timing.tick / plan.timing.physics_step)
    pairs = (
        _turns(BatchSimulation(plan, range(1, WORLDS + 1), threads), _Bare(model, threads, substeps, voltages))
        for _ in range(REPEATS)
    )
    ours, bare = zip(*pairs, strict=True)
    ratios = [theirs / own for own, theirs in zip(ours, bare, strict=True)]
    return WORLDS * DURATION / median(ours), WORLDS * DURATION / median(bare), median(ratios)


class _Bare:
    """mujoco.batch alone, with the voltages of one world's run in all of them."""

    def __init__(self, model: mujoco.MjModel, threads: int, substeps: int, voltages: np.ndarray):
        self._batch = batch.Batch(model, WORLDS, threads, persistent=True)
        self._ctrl, self._substeps, self._voltages = self._batch.bind("ctrl"), substeps, voltages

    def tick(self, index: int) -> None:
        self._ctrl[:] = self._voltages[index]
        self._batch.step(nstep=self._substeps)


def _turns(worlds: BatchSimulation, bare: _Bare) -> tuple[float, float]:
    """Return the seconds that the worlds and the bare batch take for all ticks, in turns."""
    own = other = 0.0
    began = perf_counter()

    def ticked(ticks: range) -> None:
        nonlocal own, other, began
        own += perf_counter() - began
        begin = perf_counter()
        for tick in ticks:
            bare.tick(tick)
        other += perf_counter() - begin
        began = perf_counter()

    worlds.run(ticked)
    return own, other
