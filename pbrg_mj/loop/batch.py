"""Many seeds of one scenario in a batch: a Monte Carlo run at nearly the speed of bare physics.

The stages are those of `tick`, in its order, each for all worlds before the next: sensing and perception when there is
a new frame, then governor, control and drive in one compiled call with worlds as the leading axis, shared out over
threads, then all worlds' physics in mujoco.batch. Every world is bit for bit the run of its seed alone. What a run
records besides (optimum, certificates of operation) is left out.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.evaluate import NAMES, VIOLATED, predicted_rows, worst_rows
from pbrg_mj.loop.batch_control import batch_control
from pbrg_mj.loop.batch_team import check_built_in
from pbrg_mj.loop.resources import check_memory
from pbrg_mj.perception.estimator import GuidedEstimator, estimator
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario, operator_reference, whole_number
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.batch import PlantBatch, check_batchable
from pbrg_mj.world.scene.robot import load_robot_model


@dataclass(frozen=True)
class BatchHistories:
    """What happened in W worlds at T ticks, at the start of each."""

    seeds: tuple[int, ...]
    time: np.ndarray  # (T,) [s]
    hand_world: np.ndarray  # (W, T, n, 2) q, truth [m]
    m: np.ndarray  # (W, T, n, 2) governed references as each robot knows them [m]
    wall_margin: np.ndarray  # (W, T, n) truth: hand point to nearest wall's face, less the clearance [m]
    moving_margin: np.ndarray  # (W, T, n) the same to the nearest moving box where it is [m]
    wall_contact: np.ndarray  # (W, T, n) bool, truth
    moving_contact: np.ndarray  # (W, T, n) bool, truth: with a moving box
    robot_contact: np.ndarray  # (W, T, n) bool, truth: with another robot
    diverged: np.ndarray  # (W, T) bool: the governor's estimates have left all bounds
    certificate_violated: np.ndarray  # (W, T, 3) bool: each of `evaluate.NAMES` at what the leaders apply

    @classmethod
    def blank(cls, scenario: Scenario, seeds: tuple[int, ...]) -> BatchHistories:
        """Return empty arrays for a whole run, in which there are no moving boxes."""
        ticks = whole_number(scenario.timing.duration, scenario.timing.tick) + 1
        shape = (len(seeds), ticks, scenario.robots)
        return cls(
            seeds=seeds,
            time=np.arange(ticks) * scenario.timing.tick,
            hand_world=np.empty((*shape, 2)),
            m=np.empty((*shape, 2)),
            wall_margin=np.empty(shape),
            moving_margin=np.full(shape, np.inf),
            wall_contact=np.empty(shape, dtype=bool),
            moving_contact=np.zeros(shape, dtype=bool),
            robot_contact=np.empty(shape, dtype=bool),
            diverged=np.empty(shape[:2], dtype=bool),
            certificate_violated=np.zeros((*shape[:2], len(NAMES)), dtype=bool),
        )


@dataclass
class WorldSensing:
    """Sensor readings and perception memory of one world's robots."""

    noise: SensorNoise
    readings: Readings | None
    memory: Any  # of the estimator
    half_spaces: HalfSpaces


class BatchSimulation:
    """W seeds of one scenario. It can be run once."""

    def __init__(self, scenario: Scenario, seeds: Sequence[int], threads: int | None = None):
        """Build the worlds; `threads` None means one for each core.

        Raises InputError for what cannot be stepped side by side: see `check_batchable` and `batch_control`.
        """
        if not seeds:
            raise InputError("no seeds are given; at least one is needed", key="seeds")
        check_memory(scenario, len(seeds))
        self.threads = min(threads or os.cpu_count() or 1, len(seeds))
        self.seeds, self._scenario = tuple(seeds), scenario
        check_built_in(scenario)
        self._half_spaces = _known_in_worlds(scenario, len(seeds))
        self._control = batch_control(scenario, self._half_spaces)
        self._plant = PlantBatch(scenario, len(seeds), self.threads)
        bounds = np.linspace(0, len(seeds), self.threads + 1).astype(int).tolist()
        self._shares = [range(first, last) for first, last in pairwise(bounds)]
        self._estimator = estimator(scenario, load_robot_model(scenario.robot))
        first = self._estimator.init()
        noises = (sensor_noise(scenario.model_copy(update={"seed": seed})) for seed in self.seeds)
        self._sensing = [WorldSensing(noise, None, first, first.half_spaces) for noise in noises]
        self._frames = (-2, -2)  # of the camera and the beams, when last looked at
        self._predicted = predicted_rows(scenario)

    def run(self, on_tick: Callable[[int], object] = lambda index: None) -> BatchHistories:
        """Simulate to the end and return what happened; `on_tick` is called with every tick when it is over."""
        with ThreadPoolExecutor(self.threads) as pool:
            histories = BatchHistories.blank(self._scenario, self.seeds)
            self._sense_and_perceive(0.0, None)
            self._control.initialise(operator_reference(self._scenario.operator, 0.0))
            for index in range(len(histories.time)):
                self._tick(pool, index, histories)
                on_tick(index)
        return histories

    def _tick(self, pool: ThreadPoolExecutor, index: int, histories: BatchHistories) -> None:
        time, control, states = index * self._scenario.timing.tick, self._control, self._control.states
        truths = (histories.hand_world, histories.wall_margin, histories.wall_contact, histories.robot_contact)
        self._plant.truth(*(history[:, index] for history in truths))
        if self._plant.frames() != self._frames:
            self._sense_and_perceive(time, states.m)
        reference, p = operator_reference(self._scenario.operator, time), states.p(control.team)

        def step(share: range) -> None:
            part = slice(share.start, share.stop)
            xi = states.xi[part].copy()
            control.step(share, reference)
            histories.certificate_violated[part, index] = self._violated(part, p[part], xi)

        list(pool.map(step, self._shares))
        histories.m[:, index], histories.diverged[:, index] = states.m, states.diverged
        self._plant.advance(states.command)

    def _violated(self, part: slice, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """Return which certificates are violated in each world of a part (w, 3); p, xi (w, n, 2) as before the step."""
        team, known = self._control.team, self._half_spaces
        half_spaces = HalfSpaces(known.G[part], known.h[part], known.active[part], known.binds[part])
        states = p, xi, self._control.states.m[part][:, team.network.leader > 0.0]
        return worst_rows(half_spaces, states, team.formation, self._predicted) > VIOLATED

    def _sense_and_perceive(self, time: float, m: np.ndarray | None) -> None:
        """Sense and perceive, and lay down for the governor what has changed; m (W, n, 2), None before the first tick.

        On one thread: most of it holds Python's lock, and two threads that hand it to and fro took half as long again.
        """
        self._frames = self._plant.frames()
        for world, (sensing, observation) in enumerate(zip(self._sensing, self._plant.observe(), strict=True)):
            sensing.readings = sense(observation, sensing.readings, sensing.noise)
            if isinstance(self._estimator, GuidedEstimator):
                held = None if m is None else m[world]
                found = self._estimator.step_towards(sensing.readings, time, sensing.memory, held)
            else:
                found = self._estimator.step(sensing.readings, time, sensing.memory)
            half_spaces, sensing.memory = found
            self._control.states.pose[world] = sensing.readings.body_pose
            if half_spaces is not sensing.half_spaces:
                sensing.half_spaces = half_spaces
                for name in ("G", "h", "active", "binds"):
                    getattr(self._half_spaces, name)[world] = getattr(half_spaces, name)
                self._half_spaces.closing_speeds[world] = half_spaces.closing_speeds
                self._control.learn(world, half_spaces)


def _known_in_worlds(scenario: Scenario, worlds: int) -> HalfSpaces:
    """Return the half-spaces known before the first tick, worlds first."""
    known = estimator(scenario, load_robot_model(scenario.robot)).init().half_spaces
    arrays = (known.G, known.h, known.active, known.binds, known.closing_speeds)
    return HalfSpaces(*(np.stack([array] * worlds) for array in arrays))


def side_by_side(scenario: Scenario) -> bool:
    """Whether worlds of this scenario can be stepped side by side."""
    try:
        check_batchable(scenario)
        check_built_in(scenario)
        batch_control(scenario, _known_in_worlds(scenario, 1))
    except InputError:
        return False
    return True
