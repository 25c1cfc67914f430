"""What never moves in the world, and the robots in their own frames: one SceneUpdate at the start of a log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log.scene import primitives
from pbrg_mj.log.scene.messages import body_frame
from pbrg_mj.scenario.schema import Box, Scenario, Wall, World
from pbrg_mj.world.scene.footprints import footprints_of
from pbrg_mj.world.scene.robot import RobotModel, load_robot_model

FLOOR_MARGIN = 1.0  # of drawn floor around all that is on it [m]
FLOOR_THICKNESS = 0.01  # [m]
FLAT_HEIGHT = 0.002  # of what is drawn on the floor [m]
ROBOT_HEIGHT = 0.04  # of the drawn robot [m]


def static_scene(scenario: Scenario) -> bytes:
    """Return a SceneUpdate at time 0: floor, walls, robots and, if any, all else that is seen from above."""
    world = scenario.world
    message = SceneUpdate()
    floor = message.entities.add(frame_id="world", id="floor")
    low, high = _extent(scenario)
    centre, size = (*(low + high) / 2, -FLOOR_THICKNESS / 2), (*(high - low), FLOOR_THICKNESS)
    primitives.add_box(floor, centre, 0.0, size, primitives.FLOOR_COLOR)
    layers = {
        "walls": (world.walls, primitives.WALL_COLOR),
        "boxes": ([box.as_wall() for box in world.boxes], primitives.WALL_COLOR),
        "patches": (_patches(world), primitives.PATCH_COLOR),
        "stops": (_stops(world), primitives.STOP_COLOR),
        "thresholds": ([threshold.as_wall() for threshold in world.thresholds], primitives.PATCH_COLOR),
        "ramps": (_ramp_outlines(world), primitives.PATCH_COLOR),
    }
    for name, (walls, color) in layers.items():
        if walls or name == "walls":
            _add_walls(message.entities.add(frame_id="world", id=name), walls, color)
    if world.columns or world.prisms:
        _add_columns_and_prisms(message.entities.add(frame_id="world", id="columns and prisms"), world)
    _add_robots(message, load_robot_model(scenario.robot), scenario.robots)
    return message.SerializeToString(deterministic=True)


def _extent(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower left and the upper right corner (2,) [m] of the floor to draw."""
    world = scenario.world
    terrain = [part.as_wall() for part in world.terrain]
    things = (*world.obstacles, *_patches(world), *_stops(world), *terrain)
    ends = [end for thing in things for end in (thing.start, thing.end)]
    solids = footprints_of(columns=world.columns, prisms=world.prisms)
    radius = solids.radius[:, None]
    ends += [*(solids.centre - radius), *(solids.centre + radius), *solids.corners]
    corners = [*scenario.team.start, *ends, *(one.to for one in scenario.disturbances.kidnappings)]
    return np.min(corners, axis=0) - FLOOR_MARGIN, np.max(corners, axis=0) + FLOOR_MARGIN


def _patches(world: World) -> list[Wall]:
    boxes = []
    for patch in world.patches:
        corners = np.array([patch.start, patch.end])
        size = tuple(np.ptp(corners, axis=0).tolist())
        boxes.append(Box(center=tuple(corners.mean(axis=0).tolist()), size=size, height=FLAT_HEIGHT).as_wall())
    return boxes


def _stops(world: World) -> list[Wall]:
    flat = {"height": FLAT_HEIGHT}
    return [box.at(stop).as_wall().model_copy(update=flat) for box in world.moving_boxes for stop in box.waypoints]


def _ramp_outlines(world: World) -> list[Wall]:
    return [ramp.as_wall().model_copy(update={"height": FLAT_HEIGHT}) for ramp in world.ramps]


def _add_walls(entity: Any, walls: Sequence[Wall], color: primitives.Color) -> None:
    for wall in walls:
        along = np.subtract(wall.end, wall.start)
        centre = np.add(wall.end, wall.start) / 2
        size = (float(np.hypot(*along)), wall.thickness, wall.height)
        primitives.add_box(entity, (*centre, wall.height / 2), float(np.arctan2(along[1], along[0])), size, color)


def _add_columns_and_prisms(entity: Any, world: World) -> None:
    for column in world.columns:
        size = (2 * column.radius, 2 * column.radius, column.height)
        primitives.add_cylinder(entity, (*column.center, column.height / 2), size, primitives.WALL_COLOR)
    for part in (part for prism in world.prisms for part in prism.convex()):
        primitives.add_prism(entity, part.corners, part.height, primitives.WALL_COLOR)


def _add_robots(message: SceneUpdate, model: RobotModel, count: int) -> None:
    """Add `count` robots, each fixed to its own frame: the viewer moves them with /tf."""
    diameter, half_radius = 2 * model.body_radius, model.body_radius / 2
    body, mark = (diameter, diameter, ROBOT_HEIGHT), (model.body_radius, 0.01, 0.004)
    for robot in range(count):
        entity = message.entities.add(frame_id=body_frame(robot + 1), id=body_frame(robot + 1), frame_locked=True)
        primitives.add_cylinder(entity, (0.0, 0.0, ROBOT_HEIGHT / 2), body, primitives.robot_color(robot))
        primitives.add_box(entity, (half_radius, 0.0, ROBOT_HEIGHT), 0.0, mark, primitives.HEADING_COLOR)
