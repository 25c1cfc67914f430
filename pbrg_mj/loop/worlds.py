"""Many seeds of one scenario side by side: a Monte Carlo run at nearly the speed of bare physics.

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
from pbrg_mj.loop.decide import Decisions, Team
from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.schema import Scenario, operator_reference, whole_number
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.scene.robot import load_robot_model


@dataclass(frozen=True)
class Histories:
    """What happened in W worlds at T ticks, at the start of each."""

    seeds: tuple[int, ...]
    time: np.ndarray  # (T,) [s]
    hand_world: np.ndarray  # (W, T, n, 2) q, truth [m]
    m: np.ndarray  # (W, T, n, 2) governed references as each robot knows them [m]
    wall_margin: np.ndarray  # (W, T, n) truth: hand point to nearest wall's face, less the clearance [m]
    wall_contact: np.ndarray  # (W, T, n) bool, truth
    diverged: np.ndarray  # (W, T) bool: the governor's estimates have left all bounds

    @classmethod
    def blank(cls, scenario: Scenario, seeds: tuple[int, ...]) -> Histories:
        """Return room for a whole run."""
        ticks = whole_number(scenario.timing.duration, scenario.timing.tick) + 1
        shape = (len(seeds), ticks, scenario.robots)
        return cls(
            seeds=seeds,
            time=np.arange(ticks) * scenario.timing.tick,
            hand_world=np.empty((*shape, 2)),
            m=np.empty((*shape, 2)),
            wall_margin=np.empty(shape),
            wall_contact=np.empty(shape, dtype=bool),
            diverged=np.empty(shape[:2], dtype=bool),
        )


@dataclass
class Eyes:
    """What a world's robots have read and know of the walls."""

    noise: SensorNoise
    readings: Readings | None
    walls: PerceptionMemory


class Worlds:
    """W seeds of one scenario. It can be run once."""

    def __init__(self, scenario: Scenario, seeds: Sequence[int], threads: int | None = None):
        """Build the worlds; `threads` None means one for each core.

        Raises InputError for what cannot be stepped side by side: see `check_batchable` and `Team.of`.
        """
        if not seeds:
            raise InputError("no seeds are given; at least one is needed", key="seeds")
        self.threads = min(threads or os.cpu_count() or 1, len(seeds))
        self.seeds, self._scenario = tuple(seeds), scenario
        self._team = Team.of(scenario)
        self._plant = PlantBatch(scenario, len(seeds), self.threads)
        bounds = np.linspace(0, len(seeds), self.threads + 1).astype(int).tolist()
        self._shares = [range(first, last) for first, last in pairwise(bounds)]
        robot = load_robot_model()
        self._perception = perception_setup(scenario, robot.clearance, robot.hand_offset)
        self._eyes = [
            Eyes(sensor_noise(scenario.model_copy(update={"seed": seed})), None, initial(self._perception))
            for seed in self.seeds
        ]
        self._frames = (-2, -2)  # of the camera and the beams, when last looked at

    def run(self, ticked: Callable[[int], object] = lambda index: None) -> Histories:
        """Simulate to the end and return what happened; `ticked` is told of every tick when it is over."""
        with ThreadPoolExecutor(self.threads) as pool:
            histories = Histories.blank(self._scenario, self.seeds)
            decisions = self._decisions()
            for index in range(len(histories.time)):
                self._tick(pool, index, decisions, histories)
                ticked(index)
        return histories

    def _tick(self, pool: ThreadPoolExecutor, index: int, decisions: Decisions, histories: Histories) -> None:
        time = index * self._scenario.timing.tick
        at = (histories.hand_world[:, index], histories.wall_margin[:, index], histories.wall_contact[:, index])
        self._plant.truth(*at)
        if self._plant.frames() != self._frames:
            self._look(time, decisions)
        reference = operator_reference(self._scenario.operator, time)
        list(pool.map(lambda share: decisions.decide(self._team, share, reference), self._shares))
        histories.m[:, index], histories.diverged[:, index] = decisions.m, decisions.diverged
        self._plant.advance(decisions.command)

    def _look(self, time: float, decisions: Decisions) -> None:
        """Sense and perceive, and lay down for the decisions what has changed.

        On one thread: most of it holds Python's lock, and two threads that hand it to and fro took half as long again.
        """
        self._frames = self._plant.frames()
        for world, (eyes, observation) in enumerate(zip(self._eyes, self._plant.observe(), strict=True)):
            eyes.readings = sense(observation, eyes.readings, eyes.noise)
            half_spaces, walls = perceive(eyes.readings, time, eyes.walls, self._perception)
            decisions.pose[world] = eyes.readings.body_pose
            if half_spaces is not eyes.walls.half_spaces:
                decisions.learn(world, self._team.certificate.rows(half_spaces))
            eyes.walls = walls

    def _decisions(self) -> Decisions:
        """Return where decisions begin: rows of what is known beforehand and seen first, the governor's estimates."""
        known = self._eyes[0].walls.half_spaces
        decisions = Decisions.blank(self._team, len(self.seeds), self._team.certificate.rows(known))
        self._look(0.0, decisions)
        decisions.begin(self._team, operator_reference(self._scenario.operator, 0.0))
        return decisions
