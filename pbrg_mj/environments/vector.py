"""Gymnasium: many worlds of one scenario side by side, physics in one batch, any governor."""

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
from pbrg_mj.environments.worlds import Worlds
from pbrg_mj.errors import InputError


class TeamVectorEnv(VectorEnv):
    """W seeds of one scenario, each bit for bit what `TeamEnv` makes of its seed and its actions.

    All worlds have one clock, so all begin and end together (`AutoresetMode.DISABLED`): a world that is terminated
    stands still with reward 0 until `reset`, which every world needs at the duration. Families, whose worlds differ in
    their models, go through `gymnasium.vector.SyncVectorEnv`.
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
        """Compose the model of so many worlds; `threads` None means one for each core, `keys` are those of `Options`.

        Raises InputError for what no batch can step.
        """
        if worlds < 1:
            raise InputError(f"is {worlds}; allowed: 1 or more", key="worlds")
        self._worlds, self.num_envs = Worlds(scenario, options or Options(**keys)), worlds
        if self._worlds.scenario.family_yaml is not None:
            raise InputError("worlds of a family differ in their models; allowed: gymnasium.vector.SyncVectorEnv")
        self._threads = threads or os.cpu_count() or 1
        self.layout, agents = self._worlds.layout, len(self._worlds.acting)
        self.single_observation_space = Box(-LIMIT, LIMIT, (agents * self.layout.size,), np.float32)
        self.single_action_space = Box(-1.0, 1.0, (2 * agents,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, worlds)
        self.action_space = batch_space(self.single_action_space, worlds)
        self._batch = BatchWorlds(self._worlds.first.loop, worlds, self._threads)
        self._episodes: list[Episode] = []
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
        self._batch = BatchWorlds(self._worlds.first.loop, self.num_envs, self._threads)
        loops = (self._batch.loop(world, self._worlds.settings(one)) for world, one in enumerate(seeds))
        self._episodes = [Episode(loop, self._worlds.options) for loop in loops]
        self._ended, self._over = np.zeros(self.num_envs, dtype=bool), False
        return self._observations(), {"seed": np.array(seeds)}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold the worlds' actions for a period; return observations, rewards, terminated, truncated and infos."""
        going = np.flatnonzero(~self._ended).tolist()
        if self._over or not going:
            raise InputError("no episode is under way; call reset first")
        agents = len(self._worlds.acting)
        wanted = finite_actions(actions, self.num_envs * agents).reshape(self.num_envs, agents, 2)
        for world in going:
            self._episodes[world].act(wanted[world])
        for _ in range(self._episodes[going[0]].ticks_held):
            self._batch.advance({world: self._episodes[world].command() for world in going})
            for world in going:
                self._episodes[world].record(self._batch.truth(world))
        rewards, margins = np.zeros(self.num_envs), np.full(self.num_envs, np.nan)
        for world in going:
            step = self._episodes[world].step()
            rewards[world], margins[world] = self._episodes[world].rewards(step).mean(), step.wall_margin.min()
            self._ended[world] = step.ended
        self._over = self._episodes[going[0]].timed_out
        truncated = self._over & ~self._ended
        return self._observations(), rewards, self._ended.copy(), truncated, {"wall_margin_m": margins}

    def close_extras(self, **_: Any) -> None:
        """Let go of the worlds."""
        self._episodes, self._over = [], True

    def _observations(self) -> np.ndarray:
        return np.stack([one.observations().ravel() for one in self._episodes])
