"""What goes into the file, in which order: what it takes to rerun, then a group of messages per tick."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from pbrg_mj.log import channels, scene
from pbrg_mj.log.fields import SCHEMA_VERSION, Dims
from pbrg_mj.log.schemas import CLASSES, encoder
from pbrg_mj.log.versions import versions
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.beam_layout import beam_angles
from pbrg_mj.scenario.load import Loaded
from pbrg_mj.scenario.schema import Scenario


def embed(writer: Writer, loaded: Loaded, model_xml: str, dims: Dims) -> None:
    """Write what it takes to rerun, before any tick and outside of chunks: a log cut short still has it."""
    attachments = (
        (channels.SCENARIO_ATTACHMENT, "application/yaml", loaded.yaml_text),
        (channels.MODEL_ATTACHMENT, "application/xml", model_xml),
    )
    for name, media_type, text in attachments:
        if text:
            # time 0, never the clock's: the same run makes the same bytes
            writer.add_attachment(0, 0, name, media_type, text.encode())
    numbers = {
        "schema": SCHEMA_VERSION,
        "seed": loaded.scenario.seed,
        "robots": dims["n"],
        "slots": dims["K"],
        "rows": dims["R"],
    }
    facts = {"name": loaded.name} | {key: str(value) for key, value in numbers.items()}
    writer.add_metadata(channels.RUN_METADATA, facts)
    writer.add_metadata(channels.VERSIONS_METADATA, versions())


class RecordStream:
    """Turns records into messages on an MCAP writer. Keeps what is needed to tell what is new in a tick."""

    def __init__(self, writer: Writer, scenario: Scenario, first: TickRecord, dims: Dims):
        self._writer = writer
        self._tick, self._optimum = encoder("Tick", dims), encoder("Optimum", dims)
        self._timing = encoder("Timing", dims) if scenario.log.timings else None
        self._scanning = tuple(j + 1 for j in scenario.beam_robots) if len(first.readings.ranges) else ()
        self._beam_angles = beam_angles(scenario.sensors.beams)
        self._floor_plan: bytes | None = scene.floor_plan(scenario)
        self._channels = self._register(timings=scenario.log.timings)
        self._pose_frame: int | None = None
        self._status = "ok"
        self._touching = np.zeros(dims["n"], dtype=bool)

    def add(self, record: TickRecord) -> int:
        """Write one record; return the reproducible bytes it took before compression."""
        time_ns = round(record.time * scene.NANOSECONDS)
        size = 0
        for channel, data in self._messages(record, time_ns):
            self._writer.add_message(self._channels[channel], time_ns, data, time_ns, record.index)
            size += len(data)
        if self._timing is not None:
            data = self._timing(record)
            self._writer.add_message(self._channels[channels.TIMING], time_ns, data, time_ns, record.index)
        return size

    def _messages(self, record: TickRecord, time_ns: int) -> Iterator[tuple[str, bytes]]:
        if self._floor_plan is not None:
            yield channels.SCENE, self._floor_plan
            self._floor_plan = None
        yield channels.TICK, self._tick(record)
        if record.optimum is not None:
            yield channels.OPTIMUM, self._optimum(record)
        if record.readings.pose_frame != self._pose_frame:
            yield channels.TRANSFORMS, scene.poses(record.truth.body_pose, time_ns)
            self._pose_frame = record.readings.pose_frame
        if record.readings.new_scan:
            for robot, ranges in zip(self._scanning, record.readings.ranges, strict=True):
                yield channels.scan_channel(robot), scene.scan(robot, ranges, self._beam_angles, time_ns)
        yield from self._events(record, time_ns)

    def _events(self, record: TickRecord, time_ns: int) -> Iterator[tuple[str, bytes]]:
        status, touching = record.solution.status, record.truth.wall_contact
        if status != self._status:
            text = f"governor: {status}, was {self._status}"
            yield channels.EVENTS, scene.event(text, time_ns, warning=status != "ok")
        for robot in np.flatnonzero(touching & ~self._touching):
            yield channels.EVENTS, scene.event(f"robot {robot + 1} touches a wall", time_ns, warning=True)
        self._status, self._touching = status, touching

    def _register(self, *, timings: bool) -> dict[str, int]:
        types = {
            channels.TICK: CLASSES["Tick"],
            channels.OPTIMUM: CLASSES["Optimum"],
            channels.TRANSFORMS: FrameTransforms,
            channels.SCENE: SceneUpdate,
            channels.EVENTS: Log,
        }
        types |= {channels.scan_channel(robot): LaserScan for robot in self._scanning}
        if timings:  # last, so that the other channels keep their numbers without it
            types[channels.TIMING] = CLASSES["Timing"]
        schemas = {kind: register_schema(self._writer, kind) for kind in dict.fromkeys(types.values())}
        return {topic: self._writer.register_channel(topic, "protobuf", schemas[kind]) for topic, kind in types.items()}
