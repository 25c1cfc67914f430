"""One world with its closed loop, an action at a time: what all environments are made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.environments.observation import Layout
from pbrg_mj.environments.options import Options
from pbrg_mj.environments.reward import Step
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.loop.closed_loop import ClosedLoop
from pbrg_mj.loop.tick import govern_and_command, initial_state, sense_and_perceive
from pbrg_mj.loop.tick_data import ControlTick, ExternalCommand
from pbrg_mj.scenario.schema import operator_reference, whole_number


class TrueState(NamedTuple):
    """What an episode takes of ground truth at a tick; the names are those of `Truth`."""

    hand_world: np.ndarray
    wall_margin: np.ndarray
    moving_margin: np.ndarray
    wall_contact: np.ndarray
    moving_contact: np.ndarray
    robot_contact: np.ndarray


def finite_actions(actions: Any, agents: int) -> np.ndarray:
    """Return actions as (agents, 2). Raises InputError for what are not as many finite numbers."""
    try:
        numbers = np.asarray(actions, dtype=float)
    except (TypeError, ValueError):
        raise InputError("an action is no array of numbers") from None
    if numbers.size != 2 * agents:
        raise InputError(f"an action has the shape {numbers.shape}; allowed: {2 * agents} numbers")
    if not np.isfinite(numbers).all():
        raise InputError("an action is not finite; allowed: numbers from -1 to 1")
    return numbers.reshape(agents, 2)


class Episode:
    """One episode. The world is moved on by the caller: `command`, then `world.advance`, then `record`."""

    def __init__(self, loop: ClosedLoop, options: Options):
        """Take over a closed loop at time 0."""
        self._loop, self._options, scenario = loop, options, loop.scenario
        self.layout = Layout.of(scenario, loop.network, options)
        self.acting = options.acting(loop.network)
        self._end = whole_number(scenario.timing.duration, scenario.timing.tick)
        self._ticks = options.ticks(scenario)
        state = initial_state(loop)
        self._state = state._replace(displacement=None) if options.actions == "velocities" else state
        self._sensed = sense_and_perceive(loop, self._state, 0)
        self._external, self._last, self._began = ExternalCommand(), None, 0
        self._true_states: list[TrueState] = []

    @property
    def loop(self) -> ClosedLoop:
        """What it was begun with."""
        return self._loop

    @property
    def ticks_held(self) -> int:
        """How many ticks the next action is held for: fewer at the end of the run."""
        return min(self._ticks, self._end - self._sensed.index)

    @property
    def timed_out(self) -> bool:
        """Whether the scenario's duration has passed."""
        return self._sensed.index >= self._end

    def observations(self) -> np.ndarray:
        """Return what the acting robots know, (agents, size) float32."""
        loop = self._loop
        return self.layout.observations(loop.scenario, loop.network, self._sensed, self._state.xi)[list(self.acting)]

    def act(self, actions: Any) -> None:
        """Take the acting robots' actions, (agents, 2), for the ticks to come; those beyond [-1, 1] are clipped.

        Raises InputError for what are not as many finite numbers.
        """
        options, wanted = self._options, np.clip(finite_actions(actions, len(self.acting)), -1.0, 1.0)
        if options.actions == "velocities":
            self.take_command(ExternalCommand(velocity=options.speed * wanted))
        else:
            self.take_command(
                ExternalCommand(reference=np.mean(self._sensed.p[list(self.acting)] + options.reach * wanted, axis=0))
            )

    def take_command(self, command: ExternalCommand) -> None:
        """Take what is asked of the robots for the ticks to come."""
        self._external, self._began, self._true_states = command, self._sensed.index, []

    def command(self) -> np.ndarray:
        """Return what the motors get in this tick, (n, 2)."""
        self._state, self._last = govern_and_command(self._loop, self._state, self._sensed, self._external)
        return self._last.command

    def record(self, truth: TrueState) -> None:
        """Take note of the state a tick later, and look."""
        self._true_states.append(truth)
        self._sensed = sense_and_perceive(self._loop, self._state, self._sensed.index + 1)

    def step(self) -> Step:
        """Return what came of the last action."""
        scenario, end, last = self._loop.scenario, self._true_states[-1], self._done()
        reference = operator_reference(scenario.operator, self._sensed.time)
        limit, states = scenario.divergence_limit, (end.hand_world, self._state.xi, last.solution.m)
        return Step(
            time=self._sensed.time,
            duration=(self._sensed.index - self._began) * scenario.timing.tick,
            remaining=(self._end - self._sensed.index) * scenario.timing.tick,
            hand_world=end.hand_world,
            target=reference + self._loop.formation,
            wall_margin=np.min([one.wall_margin for one in self._true_states], axis=0),
            moving_margin=np.min([one.moving_margin for one in self._true_states], axis=0),
            touched=np.any([self._violated(one) for one in self._true_states], axis=0),
            diverged=last.solution.status == "diverged" or not all(np.abs(one).max() <= limit for one in states),
            tick=last,
        )

    def rewards(self, step: Step) -> np.ndarray:
        """Return the acting robots' rewards (agents,). Raises PlugInError for a reward of another shape.

        With velocities each robot has its own; with references every leader has the mean of the whole team.
        """
        rewards = np.asarray(self._options.reward(step), dtype=float)
        if rewards.shape != (self._loop.network.robots,):
            raise PlugInError(f"the reward's shape is {rewards.shape}; allowed: a number for each robot")
        own = self._options.actions == "velocities"
        return rewards if own else np.full(len(self.acting), rewards.mean())

    def info(self, step: Step) -> Mapping[str, Any]:
        """Return what is told beside: ground truth, for measuring and never for acting."""
        return {
            "time_s": step.time,
            "wall_margin_m": float(step.wall_margin.min()),
            "touched": bool(step.touched.any()),
            "diverged": step.diverged,
            "status": step.tick.solution.status,
        }

    def _done(self) -> ControlTick:
        assert self._last is not None, "no action was taken"
        return self._last

    def _violated(self, truth: TrueState) -> np.ndarray:
        """Return which robots met what the scenario calls a violation, (n,)."""
        rules = self._loop.scenario.outcome.contacts
        touched = {"walls": truth.wall_contact, "moving": truth.moving_contact, "robots": truth.robot_contact}
        counted = [flags for kind, flags in touched.items() if getattr(rules, kind) == "violation"]
        return np.any(counted, axis=0) if counted else np.zeros(len(truth.wall_contact), dtype=bool)
