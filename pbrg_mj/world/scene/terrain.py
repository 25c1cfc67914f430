"""Thresholds and ramps, the part of the floor that is not level, as the geoms `threshold0`, `ramp0`."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Ramp, Threshold, World

COLOUR = (0.66, 0.64, 0.58, 1.0)


def add_terrain(spec: mujoco.MjSpec, world: World) -> None:
    """Add thresholds as boxes and ramps as wedges, solid down to the floor, whose contact parameters they have."""
    floor = spec.geom("floor")
    like_floor = {name: getattr(floor, name) for name in ("condim", "priority", "friction", "solref", "solimp")}
    for k, threshold in enumerate(world.thresholds):
        length, pose = _placed(threshold)
        half_size = [length / 2, threshold.width / 2, threshold.height / 2]
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": half_size}
        spec.worldbody.add_geom(name=f"threshold{k}", rgba=COLOUR, **shape, **pose, **like_floor)
    for k, ramp in enumerate(world.ramps):
        length, pose = _placed(ramp)
        across, up = ramp.width / 2, ramp.height / 2
        low = [[x, y, -up] for x in (-length / 2, length / 2) for y in (-across, across)]
        high = [[length / 2, y, up] for y in (-across, across)]
        spec.add_mesh(name=f"ramp{k}", uservert=np.ravel([*low, *high]).tolist())
        shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": f"ramp{k}"}
        spec.worldbody.add_geom(name=f"ramp{k}", rgba=COLOUR, **shape, **pose, **like_floor)


def _placed(part: Threshold | Ramp) -> tuple[float, dict[str, Any]]:
    """Return the length along the centre line, and where the middle is, x along that line."""
    start, end = np.asarray(part.start), np.asarray(part.end)
    along = end - start
    angle = float(np.arctan2(along[1], along[0]))
    return float(np.hypot(*along)), {
        "pos": [*(start + end) / 2, part.height / 2],
        "quat": [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)],
    }
