"""Poses, points, scans and events as messages in Foxglove's schemas.

A message that recurs is kept, and all in it that can change is set again: a third of the time of a new one.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame

from pbrg_mj.log.schema.message import NANOSECONDS, set_timestamp, timestamp_bytes
from pbrg_mj.log.schema.protobuf import packed_tag


def body_frame(robot: int) -> str:
    """Return the name of robot `robot`'s body frame, counted from 1."""
    return f"robot_{robot}"


class TransformsMessage:
    """FrameTransforms from the world to each of `robots` bodies."""

    def __init__(self, robots: int):
        self._message = FrameTransforms()
        for robot in range(1, robots + 1):
            self._message.transforms.add(parent_frame_id="world", child_frame_id=body_frame(robot))
        self._parts = [(one.timestamp, one.translation, one.rotation) for one in self._message.transforms]

    def serialize(self, body_pose: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `body_pose` (n, 3) x, y [m], heading [rad]."""
        seconds, nanos = divmod(time_ns, NANOSECONDS)
        for (time, position, rotation), (x, y, heading) in zip(self._parts, body_pose.tolist(), strict=True):
            time.seconds, time.nanos = seconds, nanos
            position.x, position.y, rotation.z, rotation.w = x, y, sin(heading / 2), cos(heading / 2)
        return self._message.SerializeToString(deterministic=True)


class PointsMessage:
    """PosesInFrame in the world of `count` points without a heading, all of them, in the robots' order."""

    def __init__(self, count: int):
        self._message = PosesInFrame(frame_id="world")
        for _ in range(count):
            self._message.poses.add().orientation.w = 1.0
        self._positions = [pose.position for pose in self._message.poses]

    def serialize(self, positions: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `positions` (count, 2) [m]."""
        set_timestamp(self._message, time_ns)
        for position, (x, y) in zip(self._positions, positions.tolist(), strict=True):
            position.x, position.y = x, y
        return self._message.SerializeToString(deterministic=True)


class ScanMessage:
    """The LaserScan of one robot, counted from 1.

    The beams point at `angles` (beams,) [rad], evenly spaced, counter-clockwise from straight ahead.
    """

    def __init__(self, robot: int, angles: np.ndarray):
        message = LaserScan(frame_id=body_frame(robot), start_angle=angles[0], end_angle=angles[-1])
        message.pose.orientation.w = 1.0
        field = message.DESCRIPTOR.fields_by_name["ranges"]
        self._constant = message.SerializeToString(deterministic=True) + packed_tag(field.number, 8 * len(angles))

    def serialize(self, ranges: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `ranges` (beams,) [m], NaN where a beam returned nothing.

        Put together from bytes, as protobuf would: it takes a sixth of the time.
        """
        return b"".join([timestamp_bytes(time_ns), self._constant, ranges.tobytes()])


def event_message(text: str, time_ns: int, *, warning: bool) -> bytes:
    """Return a Log message."""
    message = Log(level=Log.WARNING if warning else Log.INFO, message=text, name="pbrg")
    set_timestamp(message, time_ns)
    return message.SerializeToString(deterministic=True)
