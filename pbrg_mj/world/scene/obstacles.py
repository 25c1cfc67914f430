"""What stands or moves as geoms: `wall0`, `box0`, `column0`, `prism0`, and the body and geom `moving_box0`."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Column, MovingBox, Prism, Wall, World
from pbrg_mj.world.scene.footprints import Footprints, footprints_of

LOW_FRICTION = (0.2, 0.005, 0.0001)  # friction: robots slide along obstacles rather than climb them
MOVING_COLOUR = (0.80, 0.52, 0.16, 1.0)
UNSEEN = (0.0, 0.0, 0.0, 0.0)
PANE = (0.62, 0.80, 0.86, 0.35)
NOTHING = footprints_of()


def add_obstacles(spec: mujoco.MjSpec, surroundings: World) -> None:
    """Add all that stands on the floor: what stands still to the body `walls`, what moves as mocap bodies."""
    for k, wall in enumerate(surroundings.walls):
        _add_wall(spec, f"wall{k}", wall)
    for k, box in enumerate(surroundings.boxes):
        _add_wall(spec, f"box{k}", box.as_wall())
    for k, column in enumerate(surroundings.columns):
        _add_column(spec, f"column{k}", column)
    for k, prism in enumerate(surroundings.prisms):
        parts = prism.convex()
        for i, part in enumerate(parts):
            _add_prism(spec, f"prism{k}" if len(parts) == 1 else f"prism{k}_{i}", part)
    for k, box in enumerate(surroundings.moving_boxes):
        _add_moving_box(spec, f"moving_box{k}", box)


def box_centre(box: MovingBox, time: float | np.ndarray) -> np.ndarray:
    """Return where the middle of a moving box's footprint (2,) [m] is at `time` [s]; (t, 2) at times (t,)."""
    times = [stop.time for stop in box.waypoints]
    return np.array([np.interp(time, times, [stop.center[axis] for stop in box.waypoints]) for axis in range(2)]).T


def moving_footprints(boxes: Sequence[MovingBox], time: float) -> Footprints:
    """Return the footprints of moving boxes where they are at `time` [s]."""
    k = len(boxes)
    if not k:  # asked for at every tick
        return NOTHING
    return NOTHING._replace(
        centre=np.array([box_centre(box, time) for box in boxes]).reshape(k, 2),
        axis=np.tile([1.0, 0.0], (k, 1)),
        half_size=np.array([box.size for box in boxes], dtype=float).reshape(k, 2) / 2,
        radius=np.zeros(k),
    )


def _add_wall(spec: mujoco.MjSpec, name: str, wall: Wall) -> None:
    start, end = np.asarray(wall.start), np.asarray(wall.end)
    along = end - start
    angle = float(np.arctan2(along[1], along[0]))
    shape = {
        "type": mujoco.mjtGeom.mjGEOM_BOX,
        "size": [np.hypot(*along) / 2, wall.thickness / 2, wall.height / 2],
        "pos": [*(start + end) / 2, wall.height / 2],
        "quat": [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)],
    }
    _add_solid(spec.body("walls"), name, shape, wall.glass)


def _add_column(spec: mujoco.MjSpec, name: str, column: Column) -> None:
    shape = {
        "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
        "size": [column.radius, column.height / 2, 0],
        "pos": [*column.center, column.height / 2],
    }
    _add_solid(spec.body("walls"), name, shape, column.glass)


def _add_solid(body: mujoco.MjsBody, name: str, shape: dict, glass: bool) -> None:
    """Add a geom; one of glass as a site, too: pictures show that, and rays meet no sites."""
    body.add_geom(name=name, friction=LOW_FRICTION, **shape, **_appearance(glass))
    if glass:
        body.add_site(name=name, rgba=PANE, **shape)


def _add_prism(spec: mujoco.MjSpec, name: str, prism: Prism) -> None:
    """Add the convex hull of the corners on the floor and at the top; about their middle, for single floats."""
    corners = np.array(prism.corners)
    middle = corners.mean(axis=0)
    around = [[*(corner - middle), z] for z in (-prism.height / 2, prism.height / 2) for corner in corners]
    spec.add_mesh(name=name, uservert=np.ravel(around).tolist())
    spec.body("walls").add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        pos=[*middle, prism.height / 2],
        friction=LOW_FRICTION,
        **_appearance(prism.glass),
    )


def _appearance(glass: bool) -> dict:
    """Return what a geom looks like. MuJoCo's rays pass through what has no alpha, and pictures do not show it."""
    return {"rgba": UNSEEN} if glass else {"material": "wall"}


def _add_moving_box(spec: mujoco.MjSpec, name: str, box: MovingBox) -> None:
    body = spec.worldbody.add_body(name=name, mocap=True, pos=[*box.waypoints[0].center, box.height / 2])
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[box.size[0] / 2, box.size[1] / 2, box.height / 2],
        rgba=MOVING_COLOUR,
        friction=LOW_FRICTION,
    )
