"""PettingZoo: every robot is an agent, or, where actions are references, every leader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space
from pettingzoo import ParallelEnv

from pbrg_mj.api.scenario import Scenario
from pbrg_mj.environments.episode import Episode
from pbrg_mj.environments.observation import LIMIT
from pbrg_mj.environments.options import Options
from pbrg_mj.environments.worlds import Worlds, advance
from pbrg_mj.errors import InputError


class TeamParallelEnv(ParallelEnv):
    """A scenario, or a family of worlds, as a PettingZoo parallel environment.

    Agents are named robot_1 and so on. Observations are `Layout`'s, actions `Options`'. All agents are terminated
    together, by a contact that the scenario calls a violation or by divergence, and truncated at its duration.
    """

    def __init__(self, scenario: Scenario | str | Path, options: Options = Options()):  # noqa: B008 - frozen
        """Draw the first world. Raises InputError."""
        self._worlds = Worlds(scenario, options)
        self.layout = self._worlds.layout
        self.possible_agents = [f"robot_{robot + 1}" for robot in self._worlds.acting]
        self.agents: list[str] = []
        self.metadata, self.render_mode = {"name": "pbrg_mj_v0", "render_modes": []}, None
        size = (self.layout.size,)
        self.observation_spaces = {one: Box(-LIMIT, LIMIT, size, np.float32) for one in self.possible_agents}
        self.action_spaces = {one: Box(-1.0, 1.0, (2,), np.float32) for one in self.possible_agents}
        self._episode: Episode | None = None

    def observation_space(self, agent: str) -> Space:
        """Return an agent's observation space."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space:
        """Return an agent's action space."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, dict[str, Any]]]:
        """Begin the episode of a seed, or of the next one drawn; return observations and infos by agent."""
        number = self._worlds.next_seed(seed)
        self._episode = self._worlds.episode(number)
        self.agents = list(self.possible_agents)
        return self._by_agent(self._episode.observations()), {one: {"seed": number} for one in self.agents}

    def step(
        self, actions: dict[str, np.ndarray]
    ) -> tuple[dict[str, np.ndarray], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Hold the agents' actions for a period; return observations, rewards, terminated, truncated and infos."""
        episode = self._episode
        if episode is None or not self.agents:
            raise InputError("no episode is under way; call reset first")
        if missing := [one for one in self.agents if one not in actions]:
            raise InputError(f"there is no action of {', '.join(missing)}")
        step = advance(episode, [actions[one] for one in self.agents])
        ended, acted = step.ended, self.agents
        rewards = self._by_agent(episode.rewards(step).tolist())
        terminated, truncated = dict.fromkeys(acted, ended), dict.fromkeys(acted, episode.timed_out and not ended)
        result = self._by_agent(episode.observations()), rewards, terminated, truncated
        self.agents = [] if ended or episode.timed_out else list(acted)
        return *result, {one: dict(episode.info(step)) for one in acted}

    def render(self) -> None:
        """Draw nothing: `pbrg render` draws logs."""

    def close(self) -> None:
        """Let go of the world."""
        self._episode, self.agents = None, []

    def _by_agent(self, values: Any) -> dict[str, Any]:
        return dict(zip(self.possible_agents, values, strict=True))


def parallel_env(scenario: Scenario | str | Path, options: Options | None = None, **keys: Any) -> TeamParallelEnv:
    """Return the PettingZoo environment of a scenario or a family; `keys` are those of `Options`. Raises InputError."""
    return TeamParallelEnv(scenario, options or Options(**keys))
