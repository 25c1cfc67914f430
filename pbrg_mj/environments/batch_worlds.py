"""Worlds of one scenario in one batch of physics, each with a closed loop of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pbrg_mj.environments.episode import Episode, TrueState
from pbrg_mj.environments.worlds import Worlds
from pbrg_mj.loop.closed_loop import ClosedLoop
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.plant.interface import Observation, Truth


class BatchWorlds:
    """Worlds at time 0, one for each seed. They move on together."""

    def __init__(self, worlds: Worlds, seeds: Sequence[int], threads: int):
        """Compose the model once. Raises as `PlantBatch`."""
        loop = worlds.first.loop
        self._like, self._plant = loop, PlantBatch(loop.scenario, len(seeds), threads)
        shape = (len(seeds), loop.scenario.robots)
        self._hand, self._margin = np.empty((*shape, 2)), np.empty(shape)
        self._touched_walls, self._touched_robots = np.empty(shape, dtype=bool), np.empty(shape, dtype=bool)
        self._voltage = np.zeros((*shape, 2))
        self.observed = self._plant.observe()
        loops = (self._loop(world, worlds.settings(seed)) for world, seed in enumerate(seeds))
        self.episodes = [Episode(loop, worlds.options) for loop in loops]

    def _loop(self, world: int, scenario: Scenario) -> ClosedLoop:
        """Return the closed loop of one world, with the noise of this scenario's seed."""
        noise = sensor_noise(scenario)
        return replace(self._like, scenario=scenario, world=_OneWorld(self, world), noise=noise)

    def advance(self, voltage: Mapping[int, np.ndarray]) -> None:
        """Hold voltages (n, 2) [V] over one tick in these worlds, and 0 V in all others."""
        self._voltage[:] = 0.0
        for world, held in voltage.items():
            self._voltage[world] = held
        self._plant.advance(self._voltage)
        self._plant.truth(self._hand, self._margin, self._touched_walls, self._touched_robots)
        self.observed = self._plant.observe()

    def truth(self, world: int) -> TrueState:
        """Return one world's true state. There are no moving boxes."""
        n = self._margin.shape[1]
        still, contacts = self._margin[world].copy(), (self._touched_walls[world], self._touched_robots[world])
        walls, robots = (flags.copy() for flags in contacts)
        nothing = np.full(n, np.inf), np.zeros(n, dtype=bool)
        return TrueState(self._hand[world].copy(), still, nothing[0], walls, nothing[1], robots)


class _OneWorld:
    """One world of a batch, as a plant that others move on."""

    model_xml = ""

    def __init__(self, batch: BatchWorlds, world: int):
        self._batch, self._world = batch, world

    def observe(self) -> Observation:
        """Return the last samples."""
        return self._batch.observed[self._world]

    def truth(self) -> Truth:
        """Raise NotImplementedError: `BatchWorlds.truth` tells what a batch knows of the truth."""
        raise NotImplementedError

    def advance(self, command: np.ndarray) -> None:
        """Raise NotImplementedError: all worlds move on together."""
        raise NotImplementedError
