"""Gymnasium: many worlds side by side, any governor; those of one scenario with their physics in one batch."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from pbrg_mj.api.scenario import Scenario
from pbrg_mj.environments.batch_worlds import BatchWorlds
from pbrg_mj.environments.episode import Episode, finite_actions
from pbrg_mj.environments.observation import LIMIT
from pbrg_mj.environments.options import Options
from pbrg_mj.environments.separate_worlds import SeparateWorlds
from pbrg_mj.environments.worlds import Worlds
from pbrg_mj.errors import InputError
from pbrg_mj.world.plant.batch import is_batchable


class TeamVectorEnv(VectorEnv):
    """W seeds of a scenario or a family, each bit for bit what `TeamEnv` makes of its seed and its actions.

    All worlds have one clock, so all begin and end together (`AutoresetMode.DISABLED`): a world that is terminated
    stands still with reward 0 until `reset`, which every world needs at the duration. Worlds of a family, and of a
    scenario that no batch of physics can step, have a plant each and move on one after the other.
    """

    def __init__(
        self,
        scenario: Scenario | str | Path,
        worlds: int,
        options: Options | None = None,
        *,
        threads: int | None = None,
        **keys: Any,
    ):
        """Draw the first world; `threads`, one for each core if not given, step a batch of physics.

        `keys` are those of `Options`. Raises InputError.
        """
        if worlds < 1:
            raise InputError(f"is {worlds}; allowed: 1 or more", key="worlds")
        self._worlds, self.num_envs = Worlds(scenario, options or Options(**keys)), worlds
        self._threads = threads or os.cpu_count() or 1
        self.layout, agents = self._worlds.layout, len(self._worlds.acting)
        self.single_observation_space = Box(-LIMIT, LIMIT, (agents * self.layout.size,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (2 * agents,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, worlds)
        self.action_space = batch_space(self.single_action_space, worlds)
        self._batch: BatchWorlds | SeparateWorlds | None = None
        self._ended = np.zeros(worlds, dtype=bool)
        self._over = True
        self.metadata = {"autoreset_mode": AutoresetMode.DISABLED}

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every world: of the seeds given, of `seed` and those after it, or of seeds drawn."""
        if isinstance(seed, int | np.integer):
            seed = [seed + world for world in range(self.num_envs)]  # pyright: ignore[reportAssignmentType]
        given = seed or [None] * self.num_envs
        if len(given) != self.num_envs:
            raise InputError(f"are {len(given)}; allowed: one, or {self.num_envs}", key="seed")
        seeds = [self._worlds.next_seed(one) for one in given]
        self._batch = self._begin(seeds)
        self._ended, self._over = np.zeros(self.num_envs, dtype=bool), False
        return _observations(self._batch.episodes), {"seed": np.array(seeds)}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold the worlds' actions for a period; return observations, rewards, terminated, truncated and infos."""
        going, batch = np.flatnonzero(~self._ended).tolist(), self._batch
        if self._over or not going or batch is None:
            raise InputError("no episode is under way; call reset first")
        episodes = batch.episodes
        agents = len(self._worlds.acting)
        wanted = finite_actions(actions, self.num_envs * agents).reshape(self.num_envs, agents, 2)
        for world in going:
            episodes[world].act(wanted[world])
        for _ in range(episodes[going[0]].ticks_held):
            batch.advance({world: episodes[world].command() for world in going})
            for world in going:
                episodes[world].record(batch.truth(world))
        rewards, margins = np.zeros(self.num_envs), np.full(self.num_envs, np.nan)
        for world in going:
            step = episodes[world].step()
            rewards[world], margins[world] = episodes[world].rewards(step).mean(), step.wall_margin.min()
            self._ended[world] = step.ended
        self._over = episodes[going[0]].timed_out
        truncated = self._over & ~self._ended
        return _observations(episodes), rewards, self._ended.copy(), truncated, {"wall_margin_m": margins}

    def close_extras(self, **_: Any) -> None:
        """Let go of the worlds."""
        self._batch, self._over = None, True

    def _begin(self, seeds: Sequence[int]) -> BatchWorlds | SeparateWorlds:
        scenario = self._worlds.scenario
        if scenario.family_yaml is None and is_batchable(scenario.settings):
            return BatchWorlds(self._worlds, seeds, self._threads)
        return SeparateWorlds(self._worlds, seeds)


def _observations(episodes: Sequence[Episode]) -> np.ndarray:
    return np.stack([one.observations().ravel() for one in episodes])
