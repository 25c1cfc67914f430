"""A replay finds a run it can repeat, and one bit that it cannot."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from mcap.reader import make_reader
from mcap.writer import Writer

import pbrg_mj as pbrg
from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.log.schema.protobuf import CLASSES
from pbrg_mj.log.verify import replay
from pbrg_mj.log.verify.difference import differences
from pbrg_mj.log.verify.replay import verify
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

TICKS = 41
DURATION = "timing.duration=0.4"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five robots in physics, with beams and noise."""
    path = tmp_path_factory.mktemp("verify") / "log.mcap"
    loaded = load_scenario("paper/experiment_near", [DURATION])
    simulation = Simulation.build(loaded.scenario)
    with LogWriter(path, loaded, simulation.model_xml) as write:
        for record in simulation.records():
            write(record)
    return path


Change = Callable[[str, int, bytes], bytes | None]


def rewritten(
    log: Path, path: Path, change: Change, *, model: bytes | None = None, versions: dict | None = None
) -> Path:
    """The log with every message passed through `change` (None drops it), all checksums right."""
    with log.open("rb") as file, path.open("wb") as target:
        reader, writer = make_reader(file), Writer(target)
        writer.start()
        for one in reader.iter_attachments():
            data = model if model is not None and one.name == "model.xml" else one.data
            writer.add_attachment(0, 0, one.name, one.media_type, data)
        for one in reader.iter_metadata():
            writer.add_metadata(one.name, one.metadata | (versions or {} if one.name == "pbrg.versions" else {}))
        numbers: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic not in numbers:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(channel.topic, "protobuf", number)
            data = change(channel.topic, round(message.log_time / 1e7), message.data)
            if data is not None:
                times = (message.log_time, message.publish_time)
                writer.add_message(numbers[channel.topic], times[0], data, times[1], message.sequence)
        writer.finish()
    return path


def keep(topic: str, index: int, data: bytes) -> bytes:
    return data


def test_a_log_without_the_fields_added_since_still_verifies(log: Path, tmp_path: Path) -> None:
    def older(topic: str, index: int, data: bytes) -> bytes:
        if topic != "/tick":
            return data
        message = CLASSES["Tick"].FromString(data)
        for field in MESSAGES["Tick"]:
            if field.added:
                message.ClearField(field.name)
        return message.SerializeToString(deterministic=True)

    found = verify(rewritten(log, tmp_path / "older.mcap", older))
    assert (found.first, found.ticks) == (None, TICKS)

    def older_and_wrong(topic: str, index: int, data: bytes) -> bytes:
        message = CLASSES["Tick"].FromString(data) if topic == "/tick" and index == 9 else None
        if message is None:
            return older(topic, index, data)
        message.m[0] += 1e-12
        return older(topic, index, message.SerializeToString(deterministic=True))

    first = verify(rewritten(log, tmp_path / "wrong.mcap", older_and_wrong)).first
    assert first is not None
    assert (first.channel, first.time, first.difference.field) == ("/tick", 0.09, "m[0]")


def test_a_run_repeats_bit_for_bit(log: Path, tmp_path: Path) -> None:
    seen = []
    found = verify(log, seen.append)
    assert (found.first, found.environment_changes, found.complete, found.damage) == (None, {}, True, None)
    assert (found.ticks, len(seen), found.end) == (TICKS, TICKS, 0.4)
    with log.open("rb") as file:
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert found.messages == len([topic for topic in topics if topic != "/timing"])
    assert verify(rewritten(log, tmp_path / "same.mcap", keep)).first is None


def test_timings_may_differ(log: Path, tmp_path: Path) -> None:
    path = rewritten(log, tmp_path / "log.mcap", lambda topic, _, data: None if topic == "/timing" else data)
    assert verify(path).first is None


@pytest.mark.parametrize(
    "topic", ["/tick", "/optimum", "/scene", "/scene/team", "/poses/p", "/poses/m", "/tf", "/scan/robot_5"]
)
def test_one_bit_in_any_channel_is_found(log: Path, tmp_path: Path, topic: str) -> None:
    """The lowest bit of the last value of a message in the middle."""
    hit: list[int] = []

    def change(channel: str, index: int, data: bytes) -> bytes:
        if channel != topic or hit or (index < 20 and topic != "/scene"):
            return data
        hit.append(index)
        return data[:-8] + bytes([data[-8] ^ 1]) + data[-7:]

    found = verify(rewritten(log, tmp_path / "log.mcap", change))
    assert found.first is not None
    assert (found.first.channel, found.first.time) == (topic, pytest.approx(hit[0] * 0.01))
    assert found.ticks == hit[0] + 1  # it ends there


def test_the_field_and_both_values_are_named(log: Path, tmp_path: Path) -> None:
    told = []

    def change(topic: str, index: int, data: bytes) -> bytes:
        if (topic, index) != ("/tick", 17):
            return data
        message = CLASSES["Tick"].FromString(data)
        told.append(message.m[3])
        message.m[3] = np.nextafter(message.m[3], 9)
        told.append(message.m[3])
        return message.SerializeToString()

    first = verify(rewritten(log, tmp_path / "log.mcap", change)).first
    assert first is not None
    assert (first.channel, first.time, first.difference.field) == ("/tick", 17 * 0.01, "m[3]")
    assert (first.difference.logged, first.difference.replayed) == (repr(told[1]), repr(told[0]))
    assert first.difference.size == abs(told[1] - told[0])


def test_messages_that_are_missing_or_too_many_are_found(log: Path, tmp_path: Path) -> None:
    def without(topic: str, index: int, data: bytes) -> bytes | None:
        return None if (topic, index) == ("/optimum", 20) else data

    first = verify(rewritten(log, tmp_path / "a.mcap", without)).first
    assert first is not None
    assert (first.channel, first.time, first.difference) == ("/optimum", pytest.approx(0.2), replay.ABSENT)


def test_another_model_is_named_first(log: Path, tmp_path: Path) -> None:
    with log.open("rb") as file:
        model = next(one.data for one in make_reader(file).iter_attachments() if one.name == "model.xml")
    path = rewritten(log, tmp_path / "log.mcap", keep, model=model.replace(b"<mujoco", b"<mujoco ", 1))
    found = verify(path)
    assert found.first is not None
    assert (found.first.channel, found.first.difference.field, found.ticks) == ("model.xml", "line 1", 0)


def test_an_earlier_versions_model_is_told_in_one_line(log: Path, tmp_path: Path) -> None:
    with log.open("rb") as file:
        model = next(one.data for one in make_reader(file).iter_attachments() if one.name == "model.xml")
    earlier = model.replace(b'integrator="Euler"', b'integrator="implicitfast"')
    assert earlier != model
    path = rewritten(log, tmp_path / "log.mcap", keep, model=earlier, versions={"pbrg_mj.code": "0123456789abcdef"})
    found = pbrg.verify(path)
    (line,) = found.lines()
    assert line.startswith("another model: the log was made with pbrg_mj.code 0123456789abcdef, here is pbrg_mj.code ")
    assert "differs first at 0 s on model.xml: line " in line
    assert (found.verdict, found.ok, found.found.ticks) == ("another model", False, 0)


def test_a_cut_log_is_verified_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(log.read_bytes()[: log.stat().st_size * 3 // 4])
    found = verify(path)
    assert found.first is None
    assert 0 < found.ticks < TICKS and not found.complete
    assert found.damage == "the file ends inside a record"


def test_elsewhere_the_largest_deviation_is_told_instead(log: Path, tmp_path: Path) -> None:
    def change(topic: str, index: int, data: bytes) -> bytes:
        if topic != "/tick" or index not in (10, 30):
            return data
        message = CLASSES["Tick"].FromString(data)
        message.p[2] += index * 1e-9
        return message.SerializeToString()

    found = verify(rewritten(log, tmp_path / "log.mcap", change, versions={"numpy": "1.0"}))
    assert found.environment_changes == {"numpy": ("1.0", np.__version__)}
    assert found.ticks == TICKS
    assert found.first is not None and found.first.time == pytest.approx(0.1)
    assert list(found.deviations) == [("/tick", "p")]
    largest = found.deviations["/tick", "p"]
    assert (largest.difference.field, largest.time) == ("p[2]", pytest.approx(0.3))
    assert largest.difference.size == pytest.approx(30e-9, rel=1e-6)
    assert found.within(1e-6) and not found.within(1e-8)


def test_the_other_environment_alone_is_no_difference(log: Path, tmp_path: Path) -> None:
    found = verify(rewritten(log, tmp_path / "log.mcap", keep, versions={"python": "3.99"}))
    assert (found.first, list(found.environment_changes)) == (None, ["python"])


@pytest.mark.parametrize(("words", "same"), [(" winds up", True), (" integrates", False)])
def test_an_event_in_earlier_words_is_the_same_event(log: Path, tmp_path: Path, words: str, same: bool) -> None:
    reworded = []

    def change(topic: str, _index: int, data: bytes) -> bytes:
        event = Log.FromString(data) if topic == "/events" else None
        if event is None or ": integrator wind-up" not in event.message:
            return data
        event.message = event.message.replace(": integrator wind-up", words)
        reworded.append(event.message)
        return event.SerializeToString(deterministic=True)

    found = verify(rewritten(log, tmp_path / "log.mcap", change))
    assert reworded and (found.first is None) is same


def test_zeros_signs_and_bits_of_nan_count() -> None:
    kind = CLASSES["Optimum"]
    nan = struct.unpack("<d", b"\x01\x00\x00\x00\x00\x00\xf8\x7f")[0]
    plain = {"index": 3, "m": [0.0, 1.0], "status": "solved"}
    cases = [
        ({"cost": 0.0}, {"cost": 1e-9}, "cost", 1e-9),
        ({"cost": 0.0}, {"cost": -0.0}, "cost", 0.0),
        ({"cost": float("nan")}, {"cost": nan}, "cost", 0.0),
        ({}, {"status": "failed"}, "status", float("inf")),
        ({}, {"m": [0.0]}, "m[1]", float("inf")),
    ]
    for ours, theirs, field, size in cases:
        a, b = (kind(**(plain | one)).SerializeToString() for one in (ours, theirs))
        found = list(differences(kind, a, b))
        assert [(one.field, one.size) for one in found[:1]] == [(field, size)]
        assert found[0].logged != found[0].replayed
    assert list(differences(kind, b"\x08\x03", b"\x08\x03")) == []
