"""Range beams: rays from a robot's body in a horizontal plane."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Beams, beam_angles
from pbrg_mj.world.sensors.sampling import Sampler


def add_beams(robot: mujoco.MjSpec, beams: Beams, sampler: Sampler) -> None:
    """Add the beams, all from the site of that name, put at their height. A beam leaves along its own site's z axis."""
    origin = robot.site("beams").pos
    origin[2] = beams.height - robot.body("robot").pos[2]
    for k, angle in enumerate(beam_angles(beams).tolist()):
        name = f"beam{k}"
        robot.body("robot").add_site(name=name, pos=origin, quat=_quat_along(angle), size=[0.001] * 3, group=4)
        robot.add_sensor(
            name=name,
            type=mujoco.mjtSensor.mjSENS_RANGEFINDER,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=name,
            intprm=[1 << int(mujoco.mjtRayDataField.mjRAYDATA_DIST), 0, 0],
            **sampler.sensor_options,
        )


def _quat_along(angle: float) -> list[float]:
    """Return the turn that takes z to the horizontal ray at `angle`: down to x first, then about z."""
    c, s = np.sqrt(0.5) * np.cos(angle / 2), np.sqrt(0.5) * np.sin(angle / 2)
    return [c, -s, c, s]
