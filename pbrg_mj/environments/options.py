"""What agents do and see."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from pbrg_mj.environments.reward import Reward, distance_reward
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.schema import Scenario, whole_multiple
from pbrg_mj.team.network import Network

Actions = Literal["references", "velocities"]
Observations = Literal["half_spaces", "scans"]
FILTERED = ("none", "cbf", "potential_field")
"""Governors that leave velocities to velocity filters. All others govern m of eq. 2, which a velocity replaces."""


@dataclass(frozen=True)
class Options:
    """What an action means, what an observation holds, what a step is worth.

    An action a in [-1, 1]^2 of robot j asks for the reference p_j + reach a, or for the velocity u_j = speed a, in the
    axes of the world, and is held for `period`.
    """

    actions: Actions = "references"
    observations: Observations = "half_spaces"
    period: float = 0.1  # between actions [s]: a whole number of ticks
    reach: float = 1.0  # [m]
    speed: float = 0.5  # [m/s]
    reward: Reward = distance_reward

    def __post_init__(self) -> None:
        """Raise InputError for a value that is not allowed."""
        for name, allowed in (("actions", get_args(Actions)), ("observations", get_args(Observations))):
            if getattr(self, name) not in allowed:
                raise InputError(f"{name} is {getattr(self, name)!r}; allowed: {' or '.join(allowed)}")
        for name in ("period", "reach", "speed"):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and 0.0 < value < math.inf):
                raise InputError(f"{name} is {value!r}; allowed: a number above 0")
        if not callable(self.reward):
            raise InputError(f"reward is {self.reward!r}; allowed: a function of a step")

    def ticks(self, scenario: Scenario) -> int:
        """Return how many ticks an action is held for. Raises InputError where that is no whole number."""
        count, tick = whole_multiple(self.period, scenario.timing.tick), scenario.timing.tick
        if count is None:
            raise InputError(f"period is {self.period:g} s; allowed: a whole number of ticks of {tick:g} s")
        return count

    def acting(self, network: Network) -> tuple[int, ...]:
        """Return the robots that act: the leaders, who alone take references, or all of them."""
        robots = np.flatnonzero(network.leader) if self.actions == "references" else range(network.robots)
        return tuple(int(robot) for robot in robots)

    def check(self, scenario: Scenario) -> None:
        """Raise InputError for a scenario in which actions like these would mean nothing."""
        self.ticks(scenario)
        if self.actions == "velocities" and scenario.governor.kind not in FILTERED:
            allowed = f"allowed with velocities as actions: {', '.join(FILTERED)}"
            raise InputError(
                f"is {scenario.governor.kind}, which governs references alone; {allowed}", key="governor.kind"
            )
        if self.observations == "scans" and not (scenario.plant == "physics" and scenario.beam_robots):
            raise InputError("no robot has beams; allowed with scans as observations: physics", key="plant")
