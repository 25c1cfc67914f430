from __future__ import annotations

import resource
from dataclasses import fields
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from mcap_protobuf.schema import build_file_descriptor_set

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.read.columns import MessageColumns
from pbrg_mj.log.read.run import OptimumSeries, TickSeries, TimingSeries, open_run
from pbrg_mj.log.schema.fields import MESSAGES, Field
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.log.write.log_file import partial_path
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.record import TickRecord
from tests.records import SCENARIO_YAML, TICK, loaded, records

DIMS = {"n": 3, "K": 2, "R": 6}
MODEL = "<mujoco model='three'/>"
SERIES = {"Tick": TickSeries, "Optimum": OptimumSeries, "Timing": TimingSeries}


def write(path: Path, ticks: int = 60, *, timings: bool = True, seed: int = 1) -> Path:
    with LogWriter(path, loaded(timings=timings), MODEL) as sink:
        for record in records(ticks, seed=seed):
            sink(record)
    return path


def messages(path: Path) -> list[tuple[str, int, int, bytes]]:
    with path.open("rb") as file:
        return [
            (channel.topic, message.log_time, message.sequence, message.data)
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()
        ]


def bits(values: list[object], field: Field) -> bytes:
    return np.array(values, {"double": "<f8", "int": "<i8", "bool": "?", "text": "U"}[field.kind]).tobytes()


@pytest.mark.parametrize("name", MESSAGES)
def test_names_and_order_are_those_of_the_series(name: str) -> None:
    assert [field.name for field in MESSAGES[name]] == [field.name for field in fields(SERIES[name])]


def test_every_field_returns_bit_for_bit(tmp_path: Path) -> None:
    written = records(60)
    run = open_run(write(tmp_path / "log.mcap"))
    assert run.damage is None
    series = {"Tick": run.ticks, "Optimum": run.optima, "Timing": run.timings}
    for name, table in MESSAGES.items():
        source = [record for record in written if name != "Optimum" or record.optimum is not None]
        for field in table:
            read = getattr(series[name], field.name)
            assert read.shape == (len(source), *field.extent(DIMS)), field.name
            assert read.tobytes() == bits([attrgetter(field.source)(record) for record in source], field), field.name


def test_what_it_takes_to_rerun_is_embedded(tmp_path: Path) -> None:
    run = open_run(write(tmp_path / "log.mcap"))
    assert run.name == "three"
    assert run.scenario == loaded(timings=True).scenario
    assert run.scenario_yaml == SCENARIO_YAML.replace("TIMINGS", "true")
    assert run.model_xml == MODEL
    assert run.versions["numpy"] == np.__version__
    assert {"python", "platform", "pbrg_mj", "mujoco", "clarabel"} <= run.versions.keys()


def test_same_records_same_bytes(tmp_path: Path) -> None:
    first, second, other = (
        write(tmp_path / f"{name}.mcap", timings=False, seed=seed).read_bytes()
        for name, seed in (("first", 1), ("second", 1), ("other", 2))
    )
    assert first == second
    assert first != other


def test_timings_stay_on_their_channel(tmp_path: Path) -> None:
    with_timings = messages(write(tmp_path / "on.mcap", timings=True))
    without = messages(write(tmp_path / "off.mcap", timings=False))
    assert sum(topic == "/timing" for topic, *_ in with_timings) == 60
    assert [message for message in with_timings if message[0] != "/timing"] == without
    assert open_run(tmp_path / "off.mcap").timings.sense.shape == (0,)


def test_the_runtime_reads_what_the_encoder_writes() -> None:
    record = records(1)[0]
    for name, table in MESSAGES.items():
        data = encoder(name, DIMS)(record)
        message = CLASSES[name].FromString(data)
        columns = MessageColumns(name, DIMS)
        columns.add(data, 0, 0)
        for field, value in (
            (field, values[0]) for field, values in zip(table, columns.columns().values(), strict=True)
        ):
            truth = attrgetter(field.source)(record)
            flat = np.ravel(truth).tolist() if field.shape else truth
            held = list(getattr(message, field.name)) if field.shape else getattr(message, field.name)
            assert repr(held) == repr(flat), field.name
            assert bits([value], field) == bits([truth], field), field.name


def test_an_array_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"body_pose_true: shape \(3, 3\), not \(4, 3\)"):
        encoder("Tick", DIMS | {"n": 4})(records(1)[0])


def test_a_stranger_decodes_every_message(tmp_path: Path) -> None:
    counts: dict[str, int] = {}
    with write(tmp_path / "log.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            assert decoded.ByteSize() > 0
            if channel.topic == "/tick":
                assert decoded.index == message.sequence - 1 == round(message.log_time / 1e9 / TICK)
                assert message.log_time == message.publish_time == round(decoded.time * 1e9)
    events = counts.pop("/events")
    assert counts == {
        "/scene": 1,
        "/scene/team": 12,
        "/poses/p": 12,
        "/poses/m": 12,
        "/tick": 60,
        "/optimum": 6,
        "/timing": 60,
        "/tf": 20,
        "/scan/robot_1": 6,
        "/scan/robot_3": 6,
    }
    assert events > 17  # nine changes each way, and contacts


def test_poses_scans_and_walls_as_viewers_see_them(tmp_path: Path) -> None:
    record = records(1)[0]
    found = {}
    with write(tmp_path / "log.mcap").open("rb") as file:
        for _, channel, _, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            found.setdefault(channel.topic, decoded)
    second = found["/tf"].transforms[1]
    assert (second.parent_frame_id, second.child_frame_id) == ("world", "robot_2")
    x, y, heading = record.truth.body_pose[1]
    assert (second.translation.x, second.translation.y) == (x, y)
    turn = 2 * np.arctan2(second.rotation.z, second.rotation.w)
    np.testing.assert_allclose(np.exp(1j * turn), np.exp(1j * heading), atol=1e-15)
    scan = found["/scan/robot_3"]
    assert list(scan.ranges) == record.readings.ranges[1].tolist()
    np.testing.assert_allclose((scan.start_angle, scan.end_angle), (0.0, 2 * np.pi * 7 / 8))
    floor, walls, *_ = found["/scene"].entities
    wall = walls.cubes[0]
    assert (wall.pose.position.x, wall.pose.position.y, wall.pose.position.z) == (3.0, 1.0, 0.1)
    np.testing.assert_allclose((wall.size.x, wall.size.y, wall.size.z), (4.0, 0.1, 0.2))
    np.testing.assert_allclose(2 * np.arctan2(wall.pose.orientation.z, wall.pose.orientation.w), np.pi / 2)
    assert (floor.cubes[0].size.x, floor.cubes[0].size.y) == (5.0, 6.0)


def test_events_tell_changes_once(tmp_path: Path) -> None:
    with write(tmp_path / "log.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        events = reader.iter_decoded_messages(topics="/events")
        texts = [(round(message.log_time / 1e9 / TICK), decoded.message) for _, _, message, decoded in events]
    before = [np.zeros(3, dtype=bool)] * 4
    status, expected = "ok", []
    for record in records(60):
        if record.solution.status != status:
            expected.append((record.index, f"governor: {record.solution.status}, was {status}"))
        status = record.solution.status
        truth, told = record.truth, (" touches a wall", " touches a moving box", " touches another robot")
        now = [truth.wall_contact, truth.moving_contact, truth.robot_contact, record.winding_up]
        for words, was, flags in zip((*told, ": integrator wind-up"), before, now, strict=True):
            expected.extend((record.index, f"robot {robot + 1}{words}") for robot in np.flatnonzero(flags & ~was))
        before = now
    assert texts == expected


def test_descriptor_sets_stand_alone(tmp_path: Path) -> None:
    with write(tmp_path / "log.mcap", 1).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    stored = {schema.name: schema.data for schema in summary.schemas.values()}
    assert {"pbrg.Tick", "pbrg.Optimum", "pbrg.Timing", "foxglove.LaserScan"} <= stored.keys()
    assert stored["pbrg.Tick"] == build_file_descriptor_set(CLASSES["Tick"]).SerializeToString()


def test_nothing_is_created_before_the_first_record(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "log.mcap", loaded(timings=True), MODEL):
        pass
    assert list(tmp_path.iterdir()) == []


def test_interrupted_runs_are_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with pytest.raises(KeyboardInterrupt), LogWriter(path, loaded(timings=True), MODEL) as sink:
        for record in records(37):
            sink(record)
        raise KeyboardInterrupt
    run = open_run(path)
    assert (run.damage, len(run.ticks.time)) == (None, 37)


class Interrupted:
    """A record whose last field cannot be read any more: Ctrl-C in the middle of a write."""

    def __init__(self, record: TickRecord):
        self._record = record

    def __getattr__(self, name: str) -> object:
        if name == "optimum":
            raise KeyboardInterrupt
        return getattr(self._record, name)


def test_interrupted_inside_a_record_reads_as_killed(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    written = records(51)
    with pytest.raises(KeyboardInterrupt), LogWriter(path, loaded(timings=True), MODEL) as sink:
        for record in written[:-1]:
            sink(record)
        sink(Interrupted(written[-1]))  # type: ignore[arg-type]
    assert not path.exists()
    run = open_run(partial_path(path))
    assert (run.damage, len(run.ticks.time)) == ("the file ends before its end mark", 50)


@pytest.mark.parametrize(
    ("name", "said"),
    [("absent/log.mcap", "there is no folder"), ("folder", "it is a folder"), ("file/log.mcap", "there is no folder")],
)
def test_a_path_that_cannot_be_written_is_one_line(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match=said) as caught, LogWriter(tmp_path / name, loaded(timings=True), MODEL):
        pass
    assert "\n" not in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.parametrize(("limit", "left"), [(1000, []), (60_000, ["log.mcap.part"])])
def test_a_full_disk_is_one_line(tmp_path: Path, limit: int, left: list[str]) -> None:
    """What is left holds whole ticks."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        with pytest.raises(PbrgError) as caught, LogWriter(tmp_path / "log.mcap", loaded(timings=True), "") as sink:
            for record in records(200):
                sink(record)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    said = f"cannot write {tmp_path / 'log.mcap'}: File too large"
    assert str(caught.value).startswith(said) and "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == left
    for name in left:
        assert f"in {tmp_path / name}, of which `pbrg repair` makes a log" in str(caught.value)
        run = open_run(tmp_path / name)
        assert 0 < len(run.ticks.time) < 200 and run.damage
