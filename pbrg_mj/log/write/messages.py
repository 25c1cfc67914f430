"""From tick records to messages: the channels, and a tick's messages on them, in order.

The log writes these messages, the live view serves them, and the replay makes them again to compare.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import attrgetter

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message

from pbrg_mj.log.scene.messages import PointsMessage, ScanMessage, TransformsMessage, event_message
from pbrg_mj.log.scene.static import static_scene
from pbrg_mj.log.scene.team import TeamScene
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.fields import Dims
from pbrg_mj.log.schema.message import NANOSECONDS, LogMessage
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.schema import Scenario, beam_angles

# What an event says of a robot, and the flags (n,) of a record whose onset it is.
NOTABLE = {
    "robot {} touches a wall": attrgetter("truth.wall_contact"),
    "robot {} touches a moving box": attrgetter("truth.moving_contact"),
    "robot {} touches another robot": attrgetter("truth.robot_contact"),
    "robot {}: integrator wind-up": attrgetter("winding_up"),
}
SCENE_SECONDS = 0.1  # between pictures of the team: enough for the eye, a tenth of the log's size


def dims_of(record: TickRecord) -> Dims:
    """Return the run's dimensions as a record shows them."""
    n, slots = record.half_spaces.h.shape
    return {"n": n, "K": slots, "R": record.problem.rows.d.shape[1]}


def time_of(record: TickRecord) -> int:
    """Return a tick's simulated time [ns]."""
    return round(record.time * NANOSECONDS)


class MessageStream:
    """Turns records into messages. Keeps what it needs to see what is new in a tick."""

    def __init__(self, scenario: Scenario, first: TickRecord):
        dims = dims_of(first)
        self._tick, self._optimum = encoder("Tick", dims), encoder("Optimum", dims)
        self._timing = encoder("Timing", dims) if scenario.log.timings else None
        scanning = [j + 1 for j in scenario.beam_robots] if len(first.readings.ranges) else []
        angles = beam_angles(scenario.sensors.beams)
        self._scans = {channels.scan_channel(robot): ScanMessage(robot, angles) for robot in scanning}
        self._transforms, self._points = TransformsMessage(dims["n"]), PointsMessage(dims["n"])
        self._ticks_per_scene = max(1, round(SCENE_SECONDS / scenario.timing.tick))
        self._team = TeamScene(scenario.world.moving_boxes)
        self._static_scene: bytes | None = static_scene(scenario)  # until the first tick's messages
        self._pose_frame: int | None = None
        self._optimal_m = np.full(2, np.nan)
        self._status = "ok"
        self._notable = [bytes(dims["n"])] * len(NOTABLE)  # of each robot, as a byte, whether it is the case

    @property
    def types(self) -> dict[str, type[Message]]:
        """Channel -> protobuf class of its messages, in the order in which the log numbers them."""
        types: dict[str, type[Message]] = {
            channels.TICK: CLASSES["Tick"],
            channels.OPTIMUM: CLASSES["Optimum"],
            channels.TRANSFORMS: FrameTransforms,
            channels.SCENE: SceneUpdate,
            channels.TEAM_SCENE: SceneUpdate,
            channels.P_POSES: PosesInFrame,
            channels.M_POSES: PosesInFrame,
            channels.EVENTS: Log,
        }
        types |= dict.fromkeys(self._scans, LaserScan)
        if self._timing is not None:  # last, so that the other channels keep their numbers without it
            types[channels.TIMING] = CLASSES["Timing"]
        return types

    def messages(self, record: TickRecord) -> list[LogMessage]:
        """Return a tick's messages, the one on /timing last. Call it or `serialize` once for every record."""
        time_ns = time_of(record)
        return [LogMessage(topic, data, time_ns, time_ns) for topic, data in self.serialize(record, time_ns)]

    def serialize(self, record: TickRecord, time_ns: int) -> list[tuple[str, bytes]]:
        """Return channel and data of a tick's messages, all of which have the record's time."""
        found = self._reproducible(record, time_ns)
        if self._timing is not None:
            found.append((channels.TIMING, self._timing(record)))
        return found

    def _reproducible(self, record: TickRecord, time_ns: int) -> list[tuple[str, bytes]]:
        found = []
        if self._static_scene is not None:
            found.append((channels.SCENE, self._static_scene))
            self._static_scene = None
        found.append((channels.TICK, self._tick(record)))
        if record.optimum is not None:
            found.append((channels.OPTIMUM, self._optimum(record)))
            self._optimal_m = record.optimum.m
        readings = record.readings
        if readings.pose_frame != self._pose_frame:
            found.append((channels.TRANSFORMS, self._transforms.serialize(record.truth.body_pose, time_ns)))
            self._pose_frame = readings.pose_frame
        if record.index % self._ticks_per_scene == 0:
            found.append((channels.TEAM_SCENE, self._team.serialize(record, self._optimal_m, time_ns)))
            found.append((channels.P_POSES, self._points.serialize(record.problem.p, time_ns)))
            found.append((channels.M_POSES, self._points.serialize(record.solution.m, time_ns)))
        if readings.new_scan:
            for (topic, scan), ranges in zip(self._scans.items(), readings.ranges, strict=True):
                found.append((topic, scan.serialize(ranges, time_ns)))
        notable = [flags(record).tobytes() for flags in NOTABLE.values()]
        if record.solution.status != self._status or notable != self._notable:
            found += self._events(record.solution.status, notable, time_ns)
            self._status, self._notable = record.solution.status, notable
        return found

    def _events(self, status: str, notable: list[bytes], time_ns: int) -> Iterator[tuple[str, bytes]]:
        if status != self._status:
            text = f"governor: {status}, was {self._status}"
            yield channels.EVENTS, event_message(text, time_ns, warning=status != "ok")
        for words, before, now in zip(NOTABLE, self._notable, notable, strict=True):
            for robot in _onsets(before, now):
                yield channels.EVENTS, event_message(words.format(robot + 1), time_ns, warning=True)


def _onsets(before: bytes, now: bytes) -> list[int]:
    """Return where a 0 became a 1."""
    return [k for k, pair in enumerate(zip(before, now, strict=True)) if pair == (0, 1)]
