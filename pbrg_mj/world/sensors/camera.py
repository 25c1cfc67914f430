"""The overhead camera: where each robot's body is, as sampled frames."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math

import mujoco
import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.world.sensors.sampling import Sampler


def add_camera_sensors(robot: mujoco.MjSpec, sampler: Sampler) -> None:
    """Let the camera see a robot's centre and its x axis, from which its heading follows."""
    kinds = {"position": mujoco.mjtSensor.mjSENS_FRAMEPOS, "ahead": mujoco.mjtSensor.mjSENS_FRAMEXAXIS}
    for name, kind in kinds.items():
        robot.add_sensor(
            name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="centre", **sampler.sensor_options
        )


def fill_camera_history(model: mujoco.MjModel, data: mujoco.MjData, robots: int, camera: Sampler) -> None:
    """Fill a delayed camera's history with the poses at the start, as if robots had stood there for long."""
    mujoco.mj_kinematics(model, data)
    for j in range(robots):
        site = data.site(f"robot{j}/centre")
        values = {"position": site.xpos, "ahead": site.xmat[[0, 3, 6]]}
        for name, value in values.items():
            history = np.tile(value, (camera.history, 1))
            sensor = model.sensor(f"robot{j}/{name}").id
            # The last sample before the start was a whole period ago: the next one is due at 0.
            mujoco.mj_initSensorHistory(model, data, sensor, None, history, -camera.interval)


def camera_poses(sensordata: np.ndarray, position: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return the poses (W, n, 3) x, y, heading of all worlds, whose readings are (W, values).

    Places and x axes stand at these (n, 2) in the readings.
    """
    poses = np.empty((len(sensordata), len(position), 3))
    _write_camera_poses(sensordata, position, ahead, poses)
    return poses


@kernel
def _write_camera_poses(sensordata, position, ahead, poses):
    """Write what `camera_poses` returns to poses (W, n, 3).

    sensordata (W, values) are the readings; position (n, 2) and ahead (n, 2) say where in them places and x axes stand.
    """
    for w in range(len(sensordata)):
        for j in range(len(position)):
            poses[w, j, 0], poses[w, j, 1] = sensordata[w, position[j, 0]], sensordata[w, position[j, 1]]
            poses[w, j, 2] = math.atan2(sensordata[w, ahead[j, 1]], sensordata[w, ahead[j, 0]])
