"""Range beams: rays from a robot's body, level while the robot is."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Beams, ray_angles
from pbrg_mj.world.sensors.sampling import Sampler
from pbrg_mj.world.sensors.surfaces import Surfaces


def add_beams(robot: mujoco.MjSpec, beams: Beams, sampler: Sampler, height: float | None, surfaces: Surfaces) -> None:
    """Add the rays of all beams, all from the site of that name, put at `height` [m]; None: as the model has it.

    A ray leaves along its own site's z axis. In a scan that takes time a beam is sampled as much before the scan's end
    as its turn comes before that.
    """
    origin = robot.site("beams").pos
    if height is not None:
        origin[2] = height - robot.body("robot").pos[2]
    for k, angle in enumerate(ray_angles(beams).tolist()):
        name = f"beam{k}"
        early = beams.scan_time * (1.0 - (k // beams.rays + 1) / beams.count)
        robot.body("robot").add_site(name=name, pos=origin, quat=_quat_along(angle), size=[0.001] * 3, group=4)
        robot.add_sensor(
            name=name,
            type=mujoco.mjtSensor.mjSENS_RANGEFINDER,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=name,
            intprm=[sum(1 << int(field) for field in surfaces.fields), 0, 0],
            **sampler.options_before(early),
        )


def scan_frame(beams: Beams, sampler: Sampler, step: int) -> int:
    """Return the number of the scan held at a physics step; -1 before the first turn of one that takes time is over."""
    frame = sampler.frame(step)
    return -1 if frame == 0 and beams.scan_time > 0 else frame


def _quat_along(angle: float) -> list[float]:
    """Return the turn that takes z to the horizontal ray at `angle`: down to x first, then about z."""
    c, s = np.sqrt(0.5) * np.cos(angle / 2), np.sqrt(0.5) * np.sin(angle / 2)
    return [c, -s, c, s]
