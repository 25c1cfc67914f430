"""From tick records to messages: which channels there are, and what a tick says on them, in order.

The log writes these messages, the live view serves them, and the replay makes them again to compare.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message

from pbrg_mj.log import channels, scene
from pbrg_mj.log.fields import Dims
from pbrg_mj.log.payload import NANOSECONDS, Payload
from pbrg_mj.log.schemas import CLASSES, encoder
from pbrg_mj.log.team_scene import Points, TeamScene
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.beam_layout import beam_angles
from pbrg_mj.scenario.schema import Scenario

DRAWING_SECONDS = 0.1  # between pictures of the team: enough for the eye, a tenth of the log's size


def dims_of(record: TickRecord) -> Dims:
    """Return the run's dimensions as a record shows them."""
    n, slots = record.half_spaces.h.shape
    return {"n": n, "K": slots, "R": record.problem.rows.d.shape[1]}


class MessageStream:
    """Turns records into messages. Keeps what is needed to tell what is new in a tick."""

    def __init__(self, scenario: Scenario, first: TickRecord):
        dims = dims_of(first)
        self._tick, self._optimum = encoder("Tick", dims), encoder("Optimum", dims)
        self._timing = encoder("Timing", dims) if scenario.log.timings else None
        scanning = [j + 1 for j in scenario.beam_robots] if len(first.readings.ranges) else []
        angles = beam_angles(scenario.sensors.beams)
        self._scans = {channels.scan_channel(robot): scene.Scan(robot, angles) for robot in scanning}
        self._poses, self._points = scene.Poses(dims["n"]), Points(dims["n"])
        self._ticks_per_drawing = max(1, round(DRAWING_SECONDS / scenario.timing.tick))
        self._team = TeamScene(scenario.world.moving_boxes)
        self._floor_plan: bytes | None = scene.floor_plan(scenario)
        self._pose_frame: int | None = None
        self._optimal_m = np.full(2, np.nan)
        self._status = "ok"
        self._touching = self._winding = bytes(dims["n"])  # of each robot, as 0 or 1

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

    def messages(self, record: TickRecord) -> list[Payload]:
        """Return a tick's messages, the one on /timing last. Call it with every record, in order, once."""
        time_ns = round(record.time * NANOSECONDS)
        said = [*self._reproducible(record, time_ns)]
        if self._timing is not None:
            said.append((channels.TIMING, self._timing(record)))
        return [Payload(topic, data, record.index, time_ns, time_ns) for topic, data in said]

    def _reproducible(self, record: TickRecord, time_ns: int) -> Iterator[tuple[str, bytes]]:
        if self._floor_plan is not None:
            yield channels.SCENE, self._floor_plan
            self._floor_plan = None
        yield channels.TICK, self._tick(record)
        if record.optimum is not None:
            yield channels.OPTIMUM, self._optimum(record)
            self._optimal_m = record.optimum.m
        if record.readings.pose_frame != self._pose_frame:
            yield channels.TRANSFORMS, self._poses.draw(record.truth.body_pose, time_ns)
            self._pose_frame = record.readings.pose_frame
        if record.index % self._ticks_per_drawing == 0:
            yield channels.TEAM_SCENE, self._team.draw(record, self._optimal_m, time_ns)
            yield channels.P_POSES, self._points.draw(record.problem.p, time_ns)
            yield channels.M_POSES, self._points.draw(record.solution.m, time_ns)
        if record.readings.new_scan:
            for (topic, scan), ranges in zip(self._scans.items(), record.readings.ranges, strict=True):
                yield topic, scan.draw(ranges, time_ns)
        yield from self._events(record, time_ns)

    def _events(self, record: TickRecord, time_ns: int) -> Iterator[tuple[str, bytes]]:
        status = record.solution.status
        if status != self._status:
            text = f"governor: {status}, was {self._status}"
            yield channels.EVENTS, scene.event(text, time_ns, warning=status != "ok")
            self._status = status
        touching, winding = record.truth.wall_contact.tobytes(), record.winding_up.tobytes()
        for robot in _onsets(self._touching, touching):
            yield channels.EVENTS, scene.event(f"robot {robot + 1} touches a wall", time_ns, warning=True)
        for robot in _onsets(self._winding, winding):
            yield channels.EVENTS, scene.event(f"robot {robot + 1} winds up", time_ns, warning=True)
        self._touching, self._winding = touching, winding


def _onsets(before: bytes, now: bytes) -> list[int]:
    """Return where a 0 became a 1. Almost always nowhere, which plain bytes tell ten times faster than arrays."""
    return [k for k, pair in enumerate(zip(before, now, strict=True)) if pair == (0, 1)] if now != before else []
