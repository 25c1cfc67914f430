"""What a viewer draws, in Foxglove's well-known schemas: walls, poses, scans, events."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.scenario.schema import Scenario

FLOOR_MARGIN = 1.0  # of drawn floor around walls and robots [m]
FLOOR_THICKNESS = 0.01  # [m]
WALL_COLOR = (0.45, 0.45, 0.5, 1.0)
FLOOR_COLOR = (0.92, 0.92, 0.9, 1.0)
NANOSECONDS = 1_000_000_000


def frame_of(robot: int) -> str:
    """Return the name of robot `robot`'s body frame, counted from 1."""
    return f"robot_{robot}"


def poses(body_pose: np.ndarray, time_ns: int) -> bytes:
    """Return FrameTransforms from the world to each body; `body_pose` (n, 3) x, y [m], heading [rad]."""
    message = FrameTransforms()
    for robot, (x, y, heading) in enumerate(body_pose.tolist(), start=1):
        transform = message.transforms.add(parent_frame_id="world", child_frame_id=frame_of(robot))
        _stamp(transform, time_ns)
        transform.translation.x, transform.translation.y = x, y
        transform.rotation.z, transform.rotation.w = sin(heading / 2), cos(heading / 2)
    return message.SerializeToString(deterministic=True)


def scan(robot: int, ranges: np.ndarray, time_ns: int) -> bytes:
    """Return a LaserScan of one robot; `ranges` (beams,) [m], NaN where a beam returned nothing.

    Beam k points at 2 pi k / beams, counter-clockwise from straight ahead.
    """
    message = LaserScan(frame_id=frame_of(robot), start_angle=0.0, end_angle=2 * pi * (1 - 1 / len(ranges)))
    _stamp(message, time_ns)
    message.pose.orientation.w = 1.0
    message.ranges.extend(ranges.tolist())
    return message.SerializeToString(deterministic=True)


def event(text: str, time_ns: int, *, warning: bool) -> bytes:
    """Return a Log message."""
    message = Log(level=Log.WARNING if warning else Log.INFO, message=text, name="pbrg")
    _stamp(message, time_ns)
    return message.SerializeToString(deterministic=True)


def floor_plan(scenario: Scenario) -> bytes:
    """Return a SceneUpdate with the floor and the walls, at time 0."""
    message = SceneUpdate()
    floor = message.entities.add(frame_id="world", id="floor")
    wall_ends = [end for wall in scenario.world.walls for end in (wall.start, wall.end)]
    corners = [*scenario.team.start, *wall_ends]
    low = np.min(corners, axis=0) - FLOOR_MARGIN
    high = np.max(corners, axis=0) + FLOOR_MARGIN
    middle, size = (low + high) / 2, high - low
    _box(floor, (*middle, -FLOOR_THICKNESS / 2), 0.0, (*size, FLOOR_THICKNESS), FLOOR_COLOR)
    walls = message.entities.add(frame_id="world", id="walls")
    for wall in scenario.world.walls:
        along = np.subtract(wall.end, wall.start)
        middle = np.add(wall.end, wall.start) / 2
        size = (float(np.hypot(*along)), wall.thickness, wall.height)
        _box(walls, (*middle, wall.height / 2), float(np.arctan2(along[1], along[0])), size, WALL_COLOR)
    return message.SerializeToString(deterministic=True)


def _box(entity: Any, middle: Sequence[float], heading: float, size: Sequence[float], color: tuple[float, ...]) -> None:
    cube = entity.cubes.add()
    for target, values in ((cube.pose.position, middle), (cube.size, size)):
        target.x, target.y, target.z = values
    cube.pose.orientation.z, cube.pose.orientation.w = sin(heading / 2), cos(heading / 2)
    cube.color.r, cube.color.g, cube.color.b, cube.color.a = color


def _stamp(message: Any, time_ns: int) -> None:
    message.timestamp.seconds, message.timestamp.nanos = divmod(time_ns, NANOSECONDS)
