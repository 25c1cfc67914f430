from __future__ import annotations

import tracemalloc
from dataclasses import fields
from io import BytesIO
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import Writer

from pbrg_mj.errors import InputError
from pbrg_mj.log.read import mcap_records
from pbrg_mj.log.read.run import Run, open_run
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.log.write.writer import LogWriter
from tests.records import loaded, records

TICKS = 60
FACTS = {"name": "three", "schema": "1", "seed": "7", "robots": "3", "slots": "2", "rows": "6"}
DIMS = {"n": 3, "K": 2, "R": 6}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    with LogWriter(path, loaded(timings=True), "<mujoco/>") as sink:
        for record in records(TICKS):
            sink(record)
    return path.read_bytes()


@pytest.fixture(scope="module")
def reference(whole: bytes, tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("log") / "reference.mcap"
    path.write_bytes(whole)
    return open_run(path)


def is_prefix(run: Run, reference: Run) -> bool:
    """All that is read is what was written, from the start."""
    pairs = ((run.ticks, reference.ticks), (run.optima, reference.optima), (run.timings, reference.timings))
    for part, full in pairs:
        for field in fields(part):
            got, want = getattr(part, field.name), getattr(full, field.name)
            if got.astype(want.dtype).tobytes() != want[: len(got)].tobytes():
                return False
    return True


def read_one_line(path: Path) -> Run | None:
    """Return the run, or None for an InputError of one line. Any other exception is a failure."""
    try:
        run = open_run(path)
    except InputError as error:
        assert "\n" not in str(error)
        return None
    assert run.damage is None or "\n" not in run.damage
    return run


def test_cut_anywhere_keeps_all_whole_chunks(whole: bytes, reference: Run, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    found = []
    for length in np.linspace(1, len(whole) - 1, 50).astype(int):
        path.write_bytes(whole[:length])
        run = read_one_line(path)
        assert run is None or (run.damage is not None and is_prefix(run, reference))
        found.append(0 if run is None else len(run.ticks.time))
    assert found == sorted(found)
    assert set(found) == {0, 10, 20, 30, 40, 50, 60}


def corrupt(whole: bytes, rng: np.random.Generator) -> bytes:
    """Return the file with one random accident."""
    start = int(rng.integers(len(whole)))
    length = int(rng.integers(1, 1 + min(len(whole) - start, int(10 ** rng.uniform(0, 4)))))
    before, hit, after = whole[:start], whole[start : start + length], whole[start + length :]
    match rng.integers(6):
        case 0:  # one bit
            return before + bytes([hit[0] ^ 1 << int(rng.integers(8))]) + hit[1:] + after
        case 1:  # nonsense
            return before + rng.bytes(length) + after
        case 2:  # a hole
            return before + after
        case 3:  # a stutter
            return before + hit + hit + after
        case 4:  # a huge number
            return before + b"\xff" * 8 + whole[start + 8 :]
        case _:  # a cut
            return before


def test_random_accidents_never_raise_and_never_lie(whole: bytes, reference: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(2017)
    path = tmp_path / "accident.mcap"
    outcomes = {"refused": 0, "damaged": 0, "whole": 0}
    for _ in range(300):
        accident = corrupt(whole, rng)
        path.write_bytes(accident)
        run = read_one_line(path)
        kind = "refused" if run is None else "damaged" if run.damage else "whole"
        outcomes[kind] += 1
        assert run is None or is_prefix(run, reference)
        assert kind != "whole" or accident == whole
    assert outcomes["refused"] > 20 and outcomes["damaged"] > 100


def forge(path: Path, ticks: list[bytes], facts: dict[str, str] | None = FACTS, scenario: str | None = None) -> Path:
    """Write an MCAP file with valid checksums and these payloads on /tick."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        text = loaded(timings=True).yaml_text if scenario is None else scenario
        writer.add_attachment(0, 0, channels.SCENARIO_ATTACHMENT, "application/yaml", text.encode())
        if facts is not None:
            writer.add_metadata(channels.RUN_METADATA, facts)
        schema = writer.register_schema("pbrg.Tick", "protobuf", b"")
        channel = writer.register_channel(channels.TICK, "protobuf", schema)
        for tick in ticks:
            writer.add_message(channel, 0, tick, 0)
        writer.finish()
    return path


def test_an_altered_scenario_is_noticed(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "altered.mcap"
    assert whole.count(b"seed: 7") == 1
    path.write_bytes(whole.replace(b"seed: 7", b"seed: 8"))
    with pytest.raises(InputError, match="the checksum of an attachment does not match"):
        open_run(path)


def test_a_message_on_no_channel_ends_the_run(tmp_path: Path) -> None:
    with (tmp_path / "stray.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_message(9, 0, b"", 0)
        writer.finish()
    with (tmp_path / "stray.mcap").open("rb") as file:
        size = len(file.read())
        file.seek(len(mcap_records.MAGIC))
        with pytest.raises(mcap_records.DamageError, match="belongs to no channel"):
            list(mcap_records.read_records(file, size))


def ticks_of(count: int) -> list[bytes]:
    return [encoder("Tick", DIMS)(record) for record in records(count)]


def test_messages_that_make_no_sense_end_the_run_there(reference: Run, tmp_path: Path) -> None:
    good = ticks_of(5)
    short = CLASSES["Tick"].FromString(good[3])
    del short.m[-1]  # type: ignore[attr-defined]
    cases = {
        "cannot be read": [short.SerializeToString(), b"\xff\xff\xff", b"\x0a\xff\xff\xff\xff\x0f", b""],
        "is out of order": [good[1], good[4]],
    }
    for said, forgeries in cases.items():
        for forgery in forgeries:
            run = open_run(forge(tmp_path / "forged.mcap", [*good[:3], forgery, good[4]]))
            assert run.damage == f"message 3 on /tick {said}"
            assert len(run.ticks.time) == 3 and is_prefix(run, reference)


@pytest.mark.parametrize(
    ("facts", "scenario", "said"),
    [
        (None, None, "not a log of pbrg"),
        (FACTS | {"schema": "2"}, None, "version 2; this program reads versions up to 1"),
        (FACTS | {"schema": "one"}, None, "metadata are damaged"),
        (FACTS | {"robots": "4"}, None, "4 robots, its scenario has 3"),
        (FACTS | {"robots": "0", "slots": "0", "rows": "0"}, None, "0 robots, its scenario has 3"),
        (FACTS | {"slots": "0", "rows": "0"}, None, "no whole tick"),
        (FACTS | {"rows": "9" * 400}, None, "no whole tick"),
        (FACTS | {"rows": "-1"}, None, "metadata are damaged"),
        (FACTS, "", "holds no scenario"),
        (FACTS, "seed: [", "scenario.yaml"),
        (FACTS, "seeds: 3", "scenario.yaml"),
    ],
)
def test_strange_logs_are_refused_in_one_line(
    tmp_path: Path, facts: dict[str, str] | None, scenario: str | None, said: str
) -> None:
    path = forge(tmp_path / "forged.mcap", ticks_of(2), facts, scenario)
    with pytest.raises(InputError) as caught:
        open_run(path)
    assert said in str(caught.value) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_countless_ticks_of_no_robots_are_refused_in_little_memory(tmp_path: Path) -> None:
    none = FACTS | {"robots": "0", "slots": "0", "rows": "0"}
    path = forge(tmp_path / "forged.mcap", [b""] * 50_000, none)
    tracemalloc.start()
    with pytest.raises(InputError, match="0 robots, its scenario has 3"):
        open_run(path)
    assert tracemalloc.get_traced_memory()[1] < 10e6  # 2.3 kB a tick, were they read
    tracemalloc.stop()


def test_what_is_no_log_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "text").write_text("time,x,y\n0,1,2\n")
    (tmp_path / "magic").write_bytes(mcap_records.MAGIC)
    said = {
        "absent": "no such file",
        ".": "a folder",
        "empty": "is empty",
        "text": "not an MCAP file",
        "magic": "not a log of pbrg, or damaged",
    }
    for name, words in said.items():
        with pytest.raises(InputError, match=words):
            open_run(tmp_path / name)
    with pytest.raises(InputError, match="no whole tick"):
        open_run(forge(tmp_path / "no_ticks", []))


@pytest.mark.parametrize("claimed", [2**20 + 1, 10])
def test_a_decompression_bomb_is_not_opened(claimed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_records, "LARGEST_CHUNK", 2**20)
    monkeypatch.setattr(mcap_records.zstandard, "decompress", lambda data: pytest.fail("decompressed"))
    data = chunk("zstd", zstandard.compress(bytes(2**20 + 1)), claimed)
    with pytest.raises(mcap_records.DamageError, match="impossible size"):
        read(data)


@pytest.mark.parametrize("claimed", [2**20 + 1, 10, 2**20 - 1])
def test_no_more_of_a_bomb_is_unpacked_than_it_claims(claimed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_records, "LARGEST_CHUNK", 2**20)
    limits = []

    class Decompressor(lz4.frame.LZ4FrameDecompressor):
        def decompress(self, data: bytes, max_length: int = -1) -> bytes:
            limits.append(max_length)
            return super().decompress(data, max_length)

    monkeypatch.setattr(mcap_records.lz4.frame, "LZ4FrameDecompressor", Decompressor)
    data = chunk("lz4", lz4.frame.compress(bytes(2**20 + 1), store_size=False), claimed)
    with pytest.raises(mcap_records.DamageError, match="impossible size"):
        read(data)
    assert limits == ([] if claimed > 2**20 else [claimed + 1])


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_what_is_no_frame_is_damage(compression: str) -> None:
    with pytest.raises(mcap_records.DamageError, match=r"impossible size|cannot be decompressed"):
        read(chunk(compression, b"no frame", 10))


def test_another_compression_is_named() -> None:
    with pytest.raises(mcap_records.DamageError, match="compressed with 'bz2'; allowed: lz4, zstd"):
        read(chunk("bz2", b"", 0))


def chunk(compression: str, data: bytes, claimed: int) -> bytes:
    builder = RecordBuilder()
    Chunk(
        compression=compression,
        data=data,
        message_end_time=0,
        message_start_time=0,
        uncompressed_crc=0,
        uncompressed_size=claimed,
    ).write(builder)
    return builder.end()


def read(data: bytes) -> None:
    list(mcap_records.read_records(BytesIO(data), len(mcap_records.MAGIC) + len(data)))
