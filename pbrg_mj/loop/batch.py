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

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.evaluate import NAMES, VIOLATED, predicted_rows, worst_rows
from pbrg_mj.loop.batch_control import BatchParameters, BatchState
from pbrg_mj.loop.resources import check_memory
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.schema import Scenario, operator_reference, whole_number
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.vehicle.hand_point import hand_point
from pbrg_mj.world.plant.batch import PlantBatch
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
    walls: PerceptionMemory


class BatchSimulation:
    """W seeds of one scenario. It can be run once."""

    def __init__(self, scenario: Scenario, seeds: Sequence[int], threads: int | None = None):
        """Build the worlds; `threads` None means one for each core.

        Raises InputError for what cannot be stepped side by side: see `check_batchable` and `BatchParameters.of`.
        """
        if not seeds:
            raise InputError("no seeds are given; at least one is needed", key="seeds")
        check_memory(scenario, len(seeds))
        self.threads = min(threads or os.cpu_count() or 1, len(seeds))
        self.seeds, self._scenario = tuple(seeds), scenario
        self._team = BatchParameters.of(scenario)
        self._plant = PlantBatch(scenario, len(seeds), self.threads)
        bounds = np.linspace(0, len(seeds), self.threads + 1).astype(int).tolist()
        self._shares = [range(first, last) for first, last in pairwise(bounds)]
        robot = load_robot_model(scenario.robot)
        self._perception = perception_setup(scenario, robot.clearance, robot.hand_offset)
        self._sensing = [
            WorldSensing(sensor_noise(scenario.model_copy(update={"seed": seed})), None, initial(self._perception))
            for seed in self.seeds
        ]
        self._frames = (-2, -2)  # of the camera and the beams, when last looked at
        known = self._sensing[0].walls.half_spaces
        arrays = (known.G, known.h, known.active, known.binds)
        self._half_spaces = HalfSpaces(*(np.stack([array] * len(seeds)) for array in arrays))  # worlds first
        self._predicted = predicted_rows(scenario)

    def run(self, on_tick: Callable[[int], object] = lambda index: None) -> BatchHistories:
        """Simulate to the end and return what happened; `on_tick` is called with every tick when it is over."""
        with ThreadPoolExecutor(self.threads) as pool:
            histories = BatchHistories.blank(self._scenario, self.seeds)
            state = self._initial_state()
            for index in range(len(histories.time)):
                self._tick(pool, index, state, histories)
                on_tick(index)
        return histories

    def _tick(self, pool: ThreadPoolExecutor, index: int, state: BatchState, histories: BatchHistories) -> None:
        time = index * self._scenario.timing.tick
        truths = (histories.hand_world, histories.wall_margin, histories.wall_contact, histories.robot_contact)
        self._plant.truth(*(history[:, index] for history in truths))
        if self._plant.frames() != self._frames:
            self._sense_and_perceive(time, state)
        reference, xi = operator_reference(self._scenario.operator, time), state.xi.copy()
        list(pool.map(lambda share: state.step(self._team, share, reference), self._shares))
        histories.m[:, index], histories.diverged[:, index] = state.m, state.diverged
        histories.certificate_violated[:, index] = self._violated(state, xi)
        self._plant.advance(state.command)

    def _violated(self, state: BatchState, xi: np.ndarray) -> np.ndarray:
        """Return which certificates are violated in each world (W, 3); xi (W, n, 2) is that of before the step."""
        team, worlds = self._team, len(self.seeds)
        hands = hand_point(state.pose.reshape(-1, 3), team.sizes[0]).reshape(worlds, -1, 2)
        states = hands - team.formation, xi, state.m[:, team.network.leader > 0.0]
        return worst_rows(self._half_spaces, states, team.formation, self._predicted) > VIOLATED

    def _sense_and_perceive(self, time: float, state: BatchState) -> None:
        """Sense and perceive, and lay down for the state what has changed.

        On one thread: most of it holds Python's lock, and two threads that hand it to and fro took half as long again.
        """
        self._frames = self._plant.frames()
        for world, (sensing, observation) in enumerate(zip(self._sensing, self._plant.observe(), strict=True)):
            sensing.readings = sense(observation, sensing.readings, sensing.noise)
            half_spaces, walls = perceive(sensing.readings, time, sensing.walls, self._perception)
            state.pose[world] = sensing.readings.body_pose
            if half_spaces is not sensing.walls.half_spaces:
                state.set_rows(world, self._team.certificate.rows(half_spaces))
                for name in ("G", "h", "active", "binds"):
                    getattr(self._half_spaces, name)[world] = getattr(half_spaces, name)
            sensing.walls = walls

    def _initial_state(self) -> BatchState:
        """Return where state initialise: rows of what is known beforehand and seen first, the governor's estimates."""
        known = self._sensing[0].walls.half_spaces
        state = BatchState.blank(self._team, len(self.seeds), self._team.certificate.rows(known))
        self._sense_and_perceive(0.0, state)
        state.initialise(self._team, operator_reference(self._scenario.operator, 0.0))
        return state
