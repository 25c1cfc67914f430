"""Kinematic playback: the run's model, put where the log says. Nothing is simulated."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run, TickSeries
from pbrg_mj.world.plant.compose import compose
from pbrg_mj.world.scene.obstacles import box_centre
from pbrg_mj.world.scene.robot import WHEELS, load_robot_model

LIFTED = 0.3  # a kidnapped robot is shown this high [m]


@dataclass(frozen=True)
class Motion:
    """Robots over time, free of jumps in angle. Ticks that are not numbers repeat the last one that is."""

    time: np.ndarray  # (T,) [s]
    pose: np.ndarray  # (T, n, 3) x, y [m], heading [rad], unwrapped
    wheel: np.ndarray  # (T, n, 2) left, right [rad] turned since the first tick

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses (n, 3) and the wheels' angles (n, 2) at `time` [s], linear between ticks."""
        return between(self.time, self.pose, time), between(self.time, self.wheel, time)


def motion_of(ticks: TickSeries) -> Motion:
    """Return how the robots truly moved; the wheels' angles are integrals of their logged speeds."""
    pose = held(ticks.body_pose_true)
    pose[..., 2] = np.unwrap(pose[..., 2], axis=0)
    speed = held(ticks.wheel_speed)
    turned = np.diff(ticks.time)[:, None, None] * (speed[1:] + speed[:-1]) / 2
    wheel = np.concatenate([np.zeros_like(speed[:1]), np.cumsum(turned, axis=0)])
    return Motion(ticks.time, pose, wheel)


def between(time: np.ndarray, values: np.ndarray, at: float) -> np.ndarray:
    """Return `values` (T, ...) interpolated at one time; held before the first and after the last of `time` (T,)."""
    k = int(np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 1))
    if k == len(time) - 1 or at <= time[k]:
        return values[k].astype(float)
    share = (at - time[k]) / (time[k + 1] - time[k])
    return (1 - share) * values[k] + share * values[k + 1]


def latest(time: np.ndarray, at: float) -> int:
    """Return the index of the last of `time` (T,) that is not after `at`; -1 before the first."""
    return int(np.searchsorted(time, at + 1e-9, side="right")) - 1


def held(values: np.ndarray) -> np.ndarray:
    """Return a copy of `values` (T, ...) in which what is not finite repeats the last finite value, at first 0."""
    known = np.isfinite(values)
    steps = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(known, steps, 0), axis=0)
    filled = np.take_along_axis(values, last, axis=0)
    return np.where(np.isfinite(filled), filled, 0.0)


def smoothed(values: np.ndarray, ticks: int) -> np.ndarray:
    """Return the running mean of `values` (T, ...) over `ticks` ticks, centred; the ends are held."""
    half = min(ticks // 2, len(values) - 1)
    if half < 1:
        return values
    ends = [np.repeat(values[k : k + 1] if k == 0 else values[-1:], half, axis=0) for k in (0, 1)]
    padded = np.concatenate([np.zeros_like(values[:1]), ends[0], values, ends[1]])
    total = np.cumsum(padded, axis=0)
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)


class Playback:
    """MuJoCo's model and data of a run. The ideal plant, which has none, is shown with the usual robots."""

    def __init__(self, run: Run, motion: Motion):
        """Compile the model. Raises InputError when the log's model cannot be compiled or lacks the robots."""
        self._run, self._motion = run, motion
        self.model = _model(run)
        self.data = mujoco.MjData(self.model)
        robots = range(run.scenario.robots)
        try:
            free = [self.model.joint(f"robot{j}/free").qposadr[0] for j in robots]
            turning = not load_robot_model(run.scenario.robot).omnidirectional  # whose wheels are painted on
            wheels = [[self.model.joint(f"robot{j}/wheel_{s}").qposadr[0] for s in WHEELS] for j in robots if turning]
            self.colour = np.array([self.model.geom(f"robot{j}/bumper").rgba for j in robots])  # (n, 4)
            boxes = [self.model.body(f"moving_box{k}").mocapid[0] for k in range(len(run.scenario.world.moving_boxes))]
        except KeyError as error:
            raise InputError(f"the embedded model lacks {error.args[0]}", file=run.path) from error
        self._free, self._wheels, self._boxes = np.array(free), np.array(wheels, dtype=int).reshape(-1, 2), boxes

    def pose(self, time: float) -> None:
        """Put robots, wheels and moving boxes where they were at `time` [s]."""
        pose, wheel = self._motion.at(time)
        qpos, free = self.data.qpos, self._free
        qpos[free], qpos[free + 1] = pose[:, 0], pose[:, 1]
        qpos[free + 2] = self.model.qpos0[free + 2] + LIFTED * self._lifted(time)
        qpos[free + 3], qpos[free + 6] = np.cos(pose[:, 2] / 2), np.sin(pose[:, 2] / 2)
        qpos[free + 4] = qpos[free + 5] = 0.0
        qpos[self._wheels] = wheel[: len(self._wheels)]
        for mocap, box in zip(self._boxes, self._run.scenario.world.moving_boxes, strict=True):
            self.data.mocap_pos[mocap, :2] = box_centre(box, time)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _lifted(self, time: float) -> np.ndarray:
        """Return which robots (n,) are lifted off the floor."""
        lifted = np.zeros(len(self._free), dtype=bool)
        for one in self._run.scenario.disturbances.kidnappings:
            lifted[one.robot - 1] |= one.time <= time < one.time + one.duration
        return lifted


def _model(run: Run) -> mujoco.MjModel:
    if not run.model_xml:
        return compose(run.scenario, load_robot_model(run.scenario.robot)).compile()
    try:
        return mujoco.MjModel.from_xml_string(run.model_xml)
    except (ValueError, mujoco.FatalError) as error:
        words = str(error).strip().splitlines() or ["no reason given"]
        raise InputError(f"the embedded model cannot be compiled: {words[0]}", file=run.path) from error
