"""What a step was worth."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pbrg_mj.loop.tick_data import ControlTick

CONTACT = 10.0  # [m s]: as much as being 1 m away for 10 s


class Step(NamedTuple):
    """What came of an action. Positions, margins and contacts are ground truth, which observations never hold."""

    time: float  # at its end [s]
    duration: float  # [s]
    remaining: float  # until the scenario's duration [s]
    hand_world: np.ndarray  # (n, 2) q at its end [m]
    target: np.ndarray  # (n, 2) r + b_j: the operator's reference at its end, in each robot's place [m]
    wall_margin: np.ndarray  # (n,) least during the step: distance to what stands still, less the clearance [m]
    moving_margin: np.ndarray  # (n,) likewise, to moving boxes [m]
    touched: np.ndarray  # (n,) bool: what the scenario's `outcome.contacts` call a violation happened to it
    diverged: bool
    tick: ControlTick  # what the robots did last

    @property
    def ended(self) -> bool:
        """Whether it terminated the episode."""
        return bool(self.touched.any() or self.diverged)


Reward = Callable[[Step], np.ndarray]
"""From a step to a number for every robot, (n,)."""


def distance_reward(step: Step) -> np.ndarray:
    """Return -||q_j - b_j - r|| dt for every robot [m s], less 10 where it touched something, (n,).

    The sum over an episode is minus the time integral of a robot's distance to its place, sampled at the ends of steps.
    In a step that terminates the episode the time that is left counts with it: ending early never pays.
    """
    away = np.linalg.norm(step.hand_world - step.target, axis=1)
    return -away * (step.duration + (step.remaining if step.ended else 0.0)) - CONTACT * step.touched
