"""Gymnasium: one agent has the whole team."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from pbrg_mj.api.scenario import Scenario
from pbrg_mj.environments.episode import Episode
from pbrg_mj.environments.observation import LIMIT
from pbrg_mj.environments.options import Options
from pbrg_mj.environments.worlds import Worlds, advance
from pbrg_mj.errors import InputError


class TeamEnv(gymnasium.Env):
    """A scenario, or a family of worlds, as a Gymnasium environment.

    Observations and actions of the acting robots stand one after the other; the reward is the mean of theirs. An
    episode is terminated by a contact that the scenario calls a violation or by divergence, and truncated at its
    duration.
    """

    def __init__(self, scenario: Scenario | str | Path, options: Options | None = None, **keys: Any):
        """Draw the first world; `keys` are those of `Options`. Raises InputError."""
        self._worlds = Worlds(scenario, options or Options(**keys))
        self.layout, agents = self._worlds.layout, len(self._worlds.acting)
        self.observation_space = Box(-LIMIT, LIMIT, (agents * self.layout.size,), np.float32)
        self.action_space = Box(-1.0, 1.0, (2 * agents,), np.float32)
        self.metadata, self.render_mode = {"render_modes": []}, None
        self._episode: Episode | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin the episode of a seed, or of the next one drawn; return observation and info."""
        number = self._worlds.next_seed(seed)
        super().reset(seed=seed)
        self._episode = self._worlds.episode(number)
        return self._episode.observations().ravel(), {"seed": number}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold an action for a period; return observation, reward, terminated, truncated and info."""
        episode = self._episode
        if episode is None:
            raise InputError("no episode is under way; call reset first")
        step = advance(episode, action)
        reward, info = float(episode.rewards(step).mean()), dict(episode.info(step))
        if step.ended or episode.timed_out:
            self._episode = None
        return episode.observations().ravel(), reward, step.ended, episode.timed_out and not step.ended, info

    def close(self) -> None:
        """Let go of the world."""
        self._episode = None
