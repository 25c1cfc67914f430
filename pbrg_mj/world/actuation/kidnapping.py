"""Kidnapped robots: lifted off the floor and put down elsewhere."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.physics_steps import steps_during
from pbrg_mj.world.scene.footprints import body_pose
from pbrg_mj.world.scene.model_index import ModelIndex
from pbrg_mj.world.scene.robot import RobotModel

HOVER_CLEARANCE = 0.5  # the tallest obstacle the lowest robot hovers [m]
HOVER_SPACING = 0.1  # robots hover above each other, so that they cannot meet in the air [m]


@dataclass(frozen=True)
class Kidnapping:
    """One kidnapping in physics steps and body poses."""

    robot: int
    steps: range  # off the floor
    destination: np.ndarray  # (3,) x, y [m], heading [rad] of the body


@dataclass(frozen=True)
class LiftPose:
    """Where a robot was when it was lifted, as poses (3,) of its body."""

    true: np.ndarray
    camera: np.ndarray  # in the camera's last frame before


class Kidnappings:
    """All kidnappings of a run. A lifted robot hovers, upright and still, over the place where it was lifted."""

    def __init__(self, scenario: Scenario, robot: RobotModel, start: np.ndarray):
        """Turn seconds into physics steps; `start` (n, 3) are the bodies' poses, which the camera knows at first."""
        step, around = scenario.timing.physics_step, scenario.world
        # In the order of time: a robot that is lifted as it is put down has been put down first.
        self._kidnappings = [
            Kidnapping(
                robot=one.robot - 1,
                steps=steps_during(one.time, one.duration, step),
                destination=body_pose(np.array(one.to), np.deg2rad(one.heading_deg), robot.hand_offset),
            )
            for one in sorted(scenario.disturbances.kidnappings, key=lambda one: one.time)
        ]
        self._hover = HOVER_CLEARANCE + max(
            (thing.height for thing in (*around.all_obstacles, *around.terrain)), default=0.0
        )
        self._seen = start.copy()  # by the camera's newest frame
        self._lift_poses: dict[int, LiftPose] = {}

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData, index: ModelIndex, step: int) -> None:
        """Lift, hold or put down the robots concerned at physics step `step`, before positions are computed."""
        for number, event in enumerate(self._kidnappings):
            robot = event.robot
            if step == event.steps.start:
                self._lift_poses[number] = LiftPose(_pose(data, index, robot), self._seen[robot].copy())
            if step in event.steps:
                height = self._hover + HOVER_SPACING * robot
                _set_pose(model, data, index, robot, (self._lift_poses[number].true, height))
            elif step == event.steps.stop:
                _set_pose(model, data, index, robot, (event.destination, 0.0))

    def lifted(self, step: int) -> np.ndarray:
        """Return the robots (k,) that are off the floor at `step`."""
        return np.array([event.robot for event in self._kidnappings if step in event.steps], dtype=int)

    def record_frame(self, pose: np.ndarray, step: int) -> None:
        """Take the poses (n, 3) in a camera frame taken at `step`; robots off the floor are not in it."""
        on_floor = np.setdiff1d(np.arange(len(pose)), self.lifted(step))
        self._seen[on_floor] = pose[on_floor]

    def camera_readings(self, pose: np.ndarray, taken: int) -> np.ndarray:
        """Return the camera's readings (n, 3) of a frame taken at step `taken`; lifted robots keep their last pose."""
        pose = pose.copy()
        for number, event in enumerate(self._kidnappings):
            if taken in event.steps:
                pose[event.robot] = self._lift_poses[number].camera
        return pose


def _pose(data: mujoco.MjData, index: ModelIndex, robot: int) -> np.ndarray:
    """Return the pose (3,) of a robot's body: its x axis, turned by the quaternion, gives the heading."""
    x, y, _, w, i, j, k = data.qpos[index.free_joint[robot]]
    return np.array([x, y, np.arctan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))])


def _set_pose(model: mujoco.MjModel, data: mujoco.MjData, index: ModelIndex, robot: int, where: tuple) -> None:
    """Put a robot's body upright and at rest at a pose (3,), so many metres above the floor."""
    (x, y, heading), above = where
    joint, dofs = index.free_joint[robot], index.dofs[robot]
    standing = model.qpos0[joint[2]]
    data.qpos[joint] = [x, y, standing + above, np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)]
    data.qvel[dofs] = 0.0
    data.act[index.bristles[robot]] = 0.0  # the bristles of static friction
