"""What a viewer draws, in Foxglove's well-known schemas: the floor plan, poses, scans, events.

What is drawn again and again keeps its message, and sets all in it that can change: a third of the time of a new one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log.scene.primitives import Color
from pbrg_mj.log.scene.static import primitives as drawing
from pbrg_mj.log.scene.team import frame_of, robots
from pbrg_mj.log.schema.message import NANOSECONDS as NANOSECONDS
from pbrg_mj.log.schema.message import stamp, stamped
from pbrg_mj.log.schema.protobuf import array_head
from pbrg_mj.scenario.schema import Box, Scenario, Wall, World
from pbrg_mj.world.scene.robot import load_robot_model

FLOOR_MARGIN = 1.0  # of drawn floor around all that is on it [m]
FLOOR_THICKNESS = 0.01  # [m]
FLAT = 0.002  # height of what is drawn on the floor [m]


class Poses:
    """FrameTransforms from the world to each robot's body."""

    def __init__(self, robots: int):
        self._message = FrameTransforms()
        for robot in range(1, robots + 1):
            self._message.transforms.add(parent_frame_id="world", child_frame_id=frame_of(robot))
        self._parts = [(one.timestamp, one.translation, one.rotation) for one in self._message.transforms]

    def draw(self, body_pose: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `body_pose` (n, 3) x, y [m], heading [rad]."""
        seconds, nanos = divmod(time_ns, NANOSECONDS)
        for (time, place, turn), (x, y, heading) in zip(self._parts, body_pose.tolist(), strict=True):
            time.seconds, time.nanos = seconds, nanos
            place.x, place.y, turn.z, turn.w = x, y, sin(heading / 2), cos(heading / 2)
        return self._message.SerializeToString(deterministic=True)


class Scan:
    """The LaserScan of one robot, counted from 1.

    The beams point at `angles` (beams,) [rad], evenly spaced, counter-clockwise from straight ahead.
    """

    def __init__(self, robot: int, angles: np.ndarray):
        message = LaserScan(frame_id=frame_of(robot), start_angle=angles[0], end_angle=angles[-1])
        message.pose.orientation.w = 1.0
        field = message.DESCRIPTOR.fields_by_name["ranges"]
        self._head = message.SerializeToString(deterministic=True) + array_head(field.number, 8 * len(angles))

    def draw(self, ranges: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `ranges` (beams,) [m], NaN where a beam returned nothing.

        Put together from bytes, as protobuf would: it takes a sixth of the time.
        """
        return b"".join([stamped(time_ns), self._head, ranges.tobytes()])


def event(text: str, time_ns: int, *, warning: bool) -> bytes:
    """Return a Log message."""
    message = Log(level=Log.WARNING if warning else Log.INFO, message=text, name="pbrg")
    stamp(message, time_ns)
    return message.SerializeToString(deterministic=True)


def floor_plan(scenario: Scenario) -> bytes:
    """Return a SceneUpdate at time 0: floor, walls, robots and, if any, boxes, patches, and where moving boxes stop."""
    world = scenario.world
    message = SceneUpdate()
    floor = message.entities.add(frame_id="world", id="floor")
    low, high = _extent(scenario)
    drawing.box(
        floor, (*(low + high) / 2, -FLOOR_THICKNESS / 2), 0.0, (*(high - low), FLOOR_THICKNESS), drawing.FLOOR_COLOR
    )
    layers = {
        "walls": (world.walls, drawing.WALL_COLOR),
        "boxes": ([box.as_wall() for box in world.boxes], drawing.WALL_COLOR),
        "patches": (_patches(world), drawing.PATCH_COLOR),
        "stops": (_stops(world), drawing.STOP_COLOR),
    }
    for name, (walls, color) in layers.items():
        if walls or name == "walls":
            _walls(message.entities.add(frame_id="world", id=name), walls, color)
    robots(message, load_robot_model(), scenario.robots)
    return message.SerializeToString(deterministic=True)


def _extent(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower left and the upper right corner (2,) [m] of the floor to draw."""
    world = scenario.world
    things = (*world.obstacles, *_patches(world), *_stops(world))
    ends = [end for thing in things for end in (thing.start, thing.end)]
    corners = [*scenario.team.start, *ends, *(carry.to for carry in scenario.disturbances.carries)]
    return np.min(corners, axis=0) - FLOOR_MARGIN, np.max(corners, axis=0) + FLOOR_MARGIN


def _patches(world: World) -> list[Wall]:
    boxes = []
    for patch in world.patches:
        corners = np.array([patch.start, patch.end])
        size = tuple(np.ptp(corners, axis=0).tolist())
        boxes.append(Box(center=tuple(corners.mean(axis=0).tolist()), size=size, height=FLAT).as_wall())
    return boxes


def _stops(world: World) -> list[Wall]:
    return [
        box.at(stop).as_wall().model_copy(update={"height": FLAT}) for box in world.moving_boxes for stop in box.stops
    ]


def _walls(entity: Any, walls: Sequence[Wall], color: Color) -> None:
    for wall in walls:
        along = np.subtract(wall.end, wall.start)
        middle = np.add(wall.end, wall.start) / 2
        size = (float(np.hypot(*along)), wall.thickness, wall.height)
        drawing.box(entity, (*middle, wall.height / 2), float(np.arctan2(along[1], along[0])), size, color)
