"""Worlds with a plant each, moved on one after the other: of a family, or of what no batch of physics can step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pbrg_mj.environments.episode import TrueState
from pbrg_mj.environments.worlds import Worlds, true_state
from pbrg_mj.errors import InputError


class SeparateWorlds:
    """Worlds at time 0, one for each seed."""

    def __init__(self, worlds: Worlds, seeds: Sequence[int]):
        """Build each seed's closed loop. Raises InputError for worlds that differ in agents, spaces or durations."""
        self.episodes = [worlds.episode(seed) for seed in seeds]
        if len({(one.ticks_held, one.loop.scenario.timing.duration) for one in self.episodes}) > 1:
            raise InputError("seeds draw worlds of several durations or ticks; allowed in a batch: the same in all")

    def advance(self, commands: Mapping[int, np.ndarray]) -> None:
        """Hold what the motors get, (n, 2), over one tick in these worlds; all others stand still."""
        for world, held in commands.items():
            self.episodes[world].loop.world.advance(held)

    def truth(self, world: int) -> TrueState:
        """Return one world's true state."""
        return true_state(self.episodes[world].loop.world)
