"""The worlds of a batch that one thread steps: the stages of `tick`, in its order, each for all of them.

Worlds know nothing of each other, so groups run side by side and do not wait for each other. Compiled stages and
physics let other threads run; what holds Python's lock a group does in its turn, as two threads that hand the lock to
and fro take half as long again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Event, Lock
from typing import Any

import numpy as np

from pbrg_mj.governor.certificate.evaluate import VIOLATED, predicted_rows, worst_rows
from pbrg_mj.loop.batch_control import batch_control
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.perception.estimator import GoalDirectedEstimator, estimator
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario, operator_reference
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.scene.robot import load_robot_model


@dataclass
class WorldSensing:
    """Sensor readings and perception memory of one world's robots."""

    noise: SensorNoise
    readings: Readings | None
    memory: Any  # of the estimator
    half_spaces: HalfSpaces


class WorldGroup:
    """Some seeds of one scenario, stepped by the thread that calls."""

    def __init__(self, scenario: Scenario, seeds: Sequence[int], in_turn: Lock):
        """Build the worlds; `in_turn` is the lock that all groups share. Raises as `PlantBatch` and `batch_control`."""
        self._scenario, self._in_turn = scenario, in_turn
        self._estimator = estimator(scenario, load_robot_model(scenario.robot))
        self._goal_directed = self._estimator if isinstance(self._estimator, GoalDirectedEstimator) else None
        first = self._estimator.init()
        self._half_spaces = stacked_for_worlds(first.half_spaces, len(seeds))
        self._plant = PlantBatch(scenario, len(seeds), threads=1)
        self._control = batch_control(scenario, self._half_spaces)
        noises = (sensor_noise(scenario.model_copy(update={"seed": seed})) for seed in seeds)
        self._sensing = [WorldSensing(noise, None, first, first.half_spaces) for noise in noises]
        self._frames = (-2, -2)  # of the camera and the beams, when last looked at
        self._predicted = predicted_rows(scenario)

    def run(self, ticks: range, histories: BatchHistories, stop: Event) -> None:
        """Simulate these ticks, the next in order, or until `stop` is set; what happens goes into `histories`."""
        for index in ticks:
            if stop.is_set():
                return
            self._tick(index, histories)

    def _tick(self, index: int, histories: BatchHistories) -> None:
        time, control, states = index * self._scenario.timing.tick, self._control, self._control.states
        truths = (histories.hand_world, histories.wall_margin, histories.wall_contact, histories.robot_contact)
        self._plant.truth(*(history[:, index] for history in truths))
        reference = operator_reference(self._scenario.operator, time)
        if index == 0:
            self._sense_and_perceive(time, None)
            control.initialise(reference)
        elif self._plant.frames() != self._frames:
            self._sense_and_perceive(time, states.m)
        p, xi = states.p(control.team), states.xi.copy()
        control.step(reference)
        histories.certificate_violated[:, index] = self._violated(p, xi)
        histories.m[:, index], histories.diverged[:, index] = states.m, states.diverged
        self._plant.advance(states.command)

    def _violated(self, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return which certificates are violated in each world (W, 3); p, xi (W, n, 2) are those before the step."""
        team = self._control.team
        states = p, xi, self._control.states.m[:, team.network.leader > 0.0]
        return worst_rows(self._half_spaces, states, team.formation, self._predicted) > VIOLATED

    def _sense_and_perceive(self, time: float, m: np.ndarray | None) -> None:
        """Sense and perceive, and store what has changed for the governor; m (W, n, 2), None before the first tick."""
        self._frames = self._plant.frames()
        with self._in_turn:
            for world, (sensing, observation) in enumerate(zip(self._sensing, self._plant.observe(), strict=True)):
                sensing.readings = sense(observation, sensing.readings, sensing.noise)
                if self._goal_directed is not None:
                    held = None if m is None else m[world]
                    found = self._goal_directed.step_towards(sensing.readings, time, sensing.memory, held)
                else:
                    found = self._estimator.step(sensing.readings, time, sensing.memory)
                half_spaces, sensing.memory = found
                self._control.states.pose[world] = sensing.readings.body_pose
                if half_spaces is not sensing.half_spaces:
                    sensing.half_spaces = half_spaces
                    for array, known in zip(self._half_spaces.arrays, half_spaces.arrays, strict=True):
                        array[world] = known
                    self._control.learn(world, half_spaces)


def stacked_for_worlds(known: HalfSpaces, worlds: int) -> HalfSpaces:
    """Return half-spaces that every world has before its first tick, worlds first."""
    return HalfSpaces(*(np.stack([array] * worlds) for array in known.arrays))
