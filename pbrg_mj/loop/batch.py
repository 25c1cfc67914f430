"""Many seeds of one scenario in a batch: a Monte Carlo run at nearly the speed of bare physics.

Worlds are shared out over threads, a `WorldGroup` each. Every world is bit for bit the run of its seed alone. What a
run records besides (optimum, certificates of operation) is left out.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise, repeat
from threading import Event, Lock

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.loop.batch_control import batch_control
from pbrg_mj.loop.batch_group import WorldGroup, stacked_for_worlds
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.loop.batch_team import check_built_in
from pbrg_mj.loop.resources import check_memory
from pbrg_mj.perception.estimator import estimator
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.batch import check_batchable
from pbrg_mj.world.scene.robot import load_robot_model

TICKS_BETWEEN_REPORTS = 20  # so many groups step before they wait for each other


class BatchSimulation:
    """W seeds of one scenario. It can be run once."""

    def __init__(self, scenario: Scenario, seeds: Sequence[int], threads: int | None = None):
        """Build the worlds; `threads` None means one for each core.

        Raises InputError for what cannot be stepped side by side: see `check_batchable` and `batch_control`.
        """
        if not seeds:
            raise InputError("no seeds are given; at least one is needed", key="seeds")
        check_memory(scenario, len(seeds))
        self.threads = min(threads or os.cpu_count() or 1, len(seeds))
        self.seeds, self._scenario = tuple(seeds), scenario
        check_built_in(scenario)
        bounds = np.linspace(0, len(seeds), self.threads + 1).astype(int).tolist()
        self._parts = [slice(first, last) for first, last in pairwise(bounds)]
        in_turn = Lock()
        self._groups = [WorldGroup(scenario, self.seeds[part], in_turn) for part in self._parts]

    def run(self, on_ticks: Callable[[range], object] = lambda ticks: None) -> BatchHistories:
        """Simulate to the end and return what happened; `on_ticks` hears of ticks when they are over in all worlds."""
        histories = BatchHistories.empty(self._scenario, self.seeds)
        parts, stop = [histories.part(part) for part in self._parts], Event()
        with ThreadPoolExecutor(self.threads) as pool:
            try:
                for first in range(0, len(histories.time), TICKS_BETWEEN_REPORTS):
                    ticks = range(first, min(first + TICKS_BETWEEN_REPORTS, len(histories.time)))
                    list(pool.map(WorldGroup.run, self._groups, repeat(ticks), parts, repeat(stop)))
                    on_ticks(ticks)
            finally:
                stop.set()  # an interrupt ends every group within its tick
        return histories


def side_by_side(scenario: Scenario) -> bool:
    """Whether worlds of this scenario can be stepped side by side."""
    try:
        check_batchable(scenario)
        check_built_in(scenario)
        known = estimator(scenario, load_robot_model(scenario.robot)).init().half_spaces
        batch_control(scenario, stacked_for_worlds(known, 1))
    except InputError:
        return False
    return True
