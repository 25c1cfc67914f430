"""The run's world as a puppet: its model, put where the log says. Nothing is simulated."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.log.run import Run
from pbrg_mj.video.motion import Motion
from pbrg_mj.world.compose import compose
from pbrg_mj.world.model_index import WHEELS
from pbrg_mj.world.obstacles import box_centre
from pbrg_mj.world.robot import load_robot_model

LIFTED = 0.3  # a carried robot is shown this high [m]


class Puppet:
    """MuJoCo's model and data of a run. The ideal plant, which has none, is shown with the usual robots."""

    def __init__(self, run: Run, motion: Motion):
        """Compile the model. Raises InputError when the log's model cannot be compiled or lacks the robots."""
        self._run, self._motion = run, motion
        self.model = _model(run)
        self.data = mujoco.MjData(self.model)
        robots = range(run.scenario.robots)
        try:
            free = [self.model.joint(f"robot{j}/free").qposadr[0] for j in robots]
            wheels = [[self.model.joint(f"robot{j}/wheel_{s}").qposadr[0] for s in WHEELS] for j in robots]
            self.colour = np.array([self.model.geom(f"robot{j}/bumper").rgba for j in robots])  # (n, 4)
            boxes = [self.model.body(f"moving_box{k}").mocapid[0] for k in range(len(run.scenario.world.moving_boxes))]
        except KeyError as error:
            raise InputError(f"the embedded model lacks {error.args[0]}", file=run.path) from error
        self._free, self._wheels, self._boxes = np.array(free), np.array(wheels), boxes

    def pose(self, time: float) -> None:
        """Put robots, wheels and moving boxes where they were at `time` [s]."""
        pose, wheel = self._motion.at(time)
        qpos, free = self.data.qpos, self._free
        qpos[free], qpos[free + 1] = pose[:, 0], pose[:, 1]
        qpos[free + 2] = self.model.qpos0[free + 2] + LIFTED * self._aloft(time)
        qpos[free + 3], qpos[free + 6] = np.cos(pose[:, 2] / 2), np.sin(pose[:, 2] / 2)
        qpos[free + 4] = qpos[free + 5] = 0.0
        qpos[self._wheels] = wheel
        for mocap, box in zip(self._boxes, self._run.scenario.world.moving_boxes, strict=True):
            self.data.mocap_pos[mocap, :2] = box_centre(box, time)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _aloft(self, time: float) -> np.ndarray:
        """Return which robots (n,) are being carried."""
        carried = np.zeros(len(self._free), dtype=bool)
        for carry in self._run.scenario.disturbances.carries:
            carried[carry.robot - 1] |= carry.time <= time < carry.time + carry.duration
        return carried


def _model(run: Run) -> mujoco.MjModel:
    if not run.model_xml:
        return compose(run.scenario, load_robot_model()).compile()
    try:
        return mujoco.MjModel.from_xml_string(run.model_xml)
    except (ValueError, mujoco.FatalError) as error:
        words = str(error).strip().splitlines() or ["no reason given"]
        raise InputError(f"the embedded model cannot be compiled: {words[0]}", file=run.path) from error
