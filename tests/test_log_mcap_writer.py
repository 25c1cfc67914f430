"""The files of the compiled writer: read by mcap's own reader, the same bytes again, whole up to the last flush."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Attachment, Chunk, Header, MessageIndex, Metadata
from mcap.stream_reader import StreamReader

from pbrg_mj.log.write.mcap_writer import McapWriter

CALLS = 120
MAGIC = b"\x89MCAP0\r\n"


class Written:
    """What a file should hold."""

    def __init__(self) -> None:
        self.messages: list[tuple[str, int, bytes]] = []
        self.attachments: list[tuple[int, int, str, str, bytes]] = []
        self.metadata: list[tuple[str, dict[str, str]]] = []
        self.chunks = 0
        self.flushed = 0  # messages


def fill(writer: McapWriter, seed: int) -> Written:
    """Do what the seed says, with times in any order, channels that come late, and flushes of nothing."""
    rng = np.random.default_rng(seed)
    written, channels = Written(), {"/first": writer.add_channel("/first", "pbrg.First", b"first")}
    for number, call in enumerate(rng.choice(5, CALLS, p=[0.74, 0.06, 0.05, 0.05, 0.1]).tolist()):
        name, data = f"n\u00e4me {number}", rng.bytes(int(rng.integers(0, 300)))
        if call == 0:
            topic, time = str(rng.choice(list(channels))), int(rng.integers(2**62))
            channels[topic](data, log_time=time)
            written.messages.append((topic, time, data))
        elif call == 1:
            channels[name] = writer.add_channel(name, name, data)
        elif call == 2:
            about = (int(rng.integers(2**62)), int(rng.integers(2**62)), name, "text/plain", data)
            writer.add_attachment(*about)
            written.attachments.append(about)
        elif call == 3:
            writer.add_metadata(name, {"a": name, "b": ""})
            written.metadata.append((name, {"a": name, "b": ""}))
        else:
            writer.flush()
        if call in (2, 3, 4):  # what stands outside of chunks ends them
            written.chunks += written.flushed < len(written.messages)
            written.flushed = len(written.messages)
    return written


def finished(seed: int) -> tuple[bytes, Written]:
    file = BytesIO()
    writer = McapWriter(file)
    written = fill(writer, seed)
    writer.finish()
    return file.getvalue(), written


@pytest.mark.parametrize("seed", range(30))
def test_mcap_reads_what_was_written(seed: int) -> None:
    data, written = finished(seed)
    reader = make_reader(BytesIO(data), validate_crcs=True)
    found = [(channel.topic, one.log_time, one.data) for _, channel, one in reader.iter_messages(log_time_order=False)]
    assert found == written.messages
    attachments = [(a.create_time, a.log_time, a.name, a.media_type, a.data) for a in reader.iter_attachments()]
    assert attachments == written.attachments
    assert [(one.name, one.metadata) for one in reader.iter_metadata()] == written.metadata
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == len(written.messages)
    assert len(summary.chunk_indexes) == written.chunks + (written.flushed < len(written.messages)) > 1
    assert {channel.message_encoding for channel in summary.channels.values()} == {"protobuf"}


@pytest.mark.parametrize("seed", range(5))
def test_the_same_calls_make_the_same_bytes(seed: int) -> None:
    assert finished(seed)[0] == finished(seed)[0] != finished(seed + 1)[0]


def test_other_processes_make_the_same_bytes() -> None:
    code = "import sys, tests.test_log_mcap_writer as t; sys.stdout.buffer.write(t.finished(3)[0])"
    for hashes in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": hashes, "PYTHONPATH": str(Path(__file__).parents[1])},
            capture_output=True,
            check=True,
        )
        assert done.stdout == finished(3)[0]


def test_what_was_flushed_is_in_the_file() -> None:
    file = BytesIO()
    writer = McapWriter(file)
    written = fill(writer, 1)
    assert 0 < written.flushed < len(written.messages)
    ended = BytesIO(with_end(file.getvalue()))
    kinds = [type(one) for one in StreamReader(ended, emit_chunks=True, validate_crcs=True).records]
    assert kinds[0] is Header and set(kinds[1:-2]) == {Chunk, MessageIndex, Attachment, Metadata}
    assert kinds.count(Chunk) == written.chunks
    found = make_reader(BytesIO(with_end(file.getvalue()))).iter_messages(log_time_order=False)
    messages = [(channel.topic, one.log_time, one.data) for _, channel, one in found]
    assert messages == written.messages[: written.flushed]
    size = len(file.getvalue())
    writer.abandon()
    assert len(file.getvalue()) == size  # neither the open chunk nor a summary


def with_end(data: bytes) -> bytes:
    """The file with an end mark, without which mcap's reader reads nothing, but without a summary."""
    end = bytes([15]) + (4).to_bytes(8, "little") + bytes(4)
    footer = bytes([2]) + (20).to_bytes(8, "little") + bytes(20)
    return data + end + footer + MAGIC


def test_a_chunk_is_written_whole() -> None:
    """Between two writes to the file there is never half a chunk on the disk."""

    class Watched(BytesIO):
        def write(self, data) -> int:
            sizes.append(len(data))
            return super().write(data)

    sizes: list[int] = []
    writer = McapWriter(Watched())
    add = writer.add_channel("/one", "One", b"")
    for number in range(200):
        add(np.random.default_rng(number).bytes(2000), log_time=number)
    assert sizes == [sizes[0]]  # the header
    writer.flush()
    assert len([size for size in sizes if size > 400_000]) == 1
    assert len(sizes) == 3  # header, chunk, index of its messages


class Full(BytesIO):
    """A disk that is full after some bytes."""

    def write(self, data) -> int:
        if self.tell() + len(data) > 2000:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data)


class Interrupted(BytesIO):
    """Ctrl-C while a chunk is written."""

    def write(self, data) -> int:
        if self.tell() + len(data) > 2000:
            raise KeyboardInterrupt
        return super().write(data)


WRITES: dict[str, Callable[[McapWriter], None]] = {
    "flush": McapWriter.flush,
    "finish": McapWriter.finish,
    "attachment": lambda writer: writer.add_attachment(0, 0, "name", "text/plain", bytes(3000)),
}


@pytest.mark.parametrize(("file", "error"), [(Full(), OSError), (Interrupted(), KeyboardInterrupt)])
@pytest.mark.parametrize("what", WRITES)
def test_what_the_file_raises_is_raised(
    file: BytesIO, error: type[BaseException], what: str, capfd: pytest.CaptureFixture[str]
) -> None:
    file.seek(0)
    file.truncate()
    writer = McapWriter(file)
    writer.add_channel("/one", "One", b"")(np.random.default_rng(1).bytes(3000), log_time=1)
    with pytest.raises(error):
        WRITES[what](writer)
    writer.abandon()
    del writer
    assert capfd.readouterr().err == ""
