"""The worlds that seeds draw: of a scenario other noise, of a family other obstacles, starts and references."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pbrg_mj.api.scenario import Scenario, as_scenario
from pbrg_mj.environments.episode import Episode, TrueState
from pbrg_mj.environments.options import Options
from pbrg_mj.environments.reward import Step
from pbrg_mj.errors import InputError
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.schema import Scenario as Settings
from pbrg_mj.world.plant.interface import Plant

LARGEST_SEED = 2**31


class Worlds:
    """Episodes by their seeds. All have the same agents and the same spaces."""

    def __init__(self, scenario: Scenario | str | Path, options: Options):
        """Draw the first world, that of the scenario's own seed. Raises InputError."""
        self.scenario, self.options = as_scenario(scenario), options
        options.check(self.scenario.settings)
        self._random = np.random.default_rng(self.scenario.settings.seed)
        self.first = self._episode(self.scenario.settings)
        self.acting, self.layout = self.first.acting, self.first.layout

    def next_seed(self, seed: int | None) -> int:
        """Return the seed given, or the next one drawn; a seed given is where drawing goes on from.

        Raises InputError for one that is no whole number from 0.
        """
        if seed is not None:
            if not isinstance(seed, int | np.integer) or seed < 0:
                raise InputError(f"is {seed!r}; allowed: whole numbers from 0", key="seed")
            self._random = np.random.default_rng(seed)
            return int(seed)
        return int(self._random.integers(LARGEST_SEED))

    def episode(self, seed: int) -> Episode:
        """Return the episode of a seed. Raises InputError for a world whose agents or spaces would be others."""
        made = self._episode(self.settings(seed))
        other = _difference(made, self.first)
        if other is not None:
            what, key = other
            raise InputError(
                f"seed {seed} draws {what}; allowed: the same in all worlds of an environment, such as by {key}"
            )
        return made

    def settings(self, seed: int) -> Settings:
        """Return what the seed draws, without a centralized optimum."""
        if self.scenario.family_yaml is not None:
            drawn = self.scenario.override(seed=seed).settings
        else:
            drawn = self.scenario.settings.model_copy(update={"seed": seed})
        return _without_optimum(drawn)

    def _episode(self, settings: Settings) -> Episode:
        return Episode(Simulation.build(_without_optimum(settings)).loop, self.options)


def _difference(made: Episode, first: Episode) -> tuple[str, str] | None:
    """Return in what agents or observations of an episode are not those of the first, and a key that fixes it."""
    robots = f"draw.team.robots={len(first.layout.neighbours)}"
    if made.acting != first.acting:
        return f"{len(made.acting)} acting robots in place of {len(first.acting)}", robots
    then = first.layout.counts
    told = {
        "neighbours": ("neighbours", robots),
        "half_spaces": ("half-spaces", f"estimator.half_spaces_per_robot={then.get('half_spaces')}"),
        "scan": ("beams", "sensors.beams.preset=generic"),
    }
    for part, now in made.layout.counts.items():
        if now != then[part]:
            noun, key = told[part]
            return f"{now} {noun} of a robot in place of {then[part]}", key
    return None


def advance(episode: Episode, actions: Any) -> Step:
    """Let the next step of an episode pass in its own world, and return what came of it."""
    episode.act(actions)
    world = episode.loop.world
    for _ in range(episode.ticks_held):
        world.advance(episode.command())
        episode.record(true_state(world))
    return episode.step()


def true_state(world: Plant) -> TrueState:
    """Return what an episode takes of a world's ground truth."""
    truth = world.truth()
    return TrueState(*(getattr(truth, name) for name in TrueState._fields))


def _without_optimum(settings: Settings) -> Settings:
    return settings.model_copy(update={"reference": settings.reference.model_copy(update={"solver": "none"})})
