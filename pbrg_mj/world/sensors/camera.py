"""The camera's history before the start of the run."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.world.sensors.sampling import Sampler


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
