"""A clean log of what a damaged one still holds: its embedded files and all whole chunks."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from shutil import copyfileobj
from typing import BinaryIO, NamedTuple

from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.header import EmbeddedFiles, open_mcap
from pbrg_mj.log.read.mcap_records import (
    MAGIC,
    MESSAGE_PREFIX,
    RECORD_PREFIX,
    DamageError,
    check_end,
    decompress_chunk,
    parse_attachment,
    parse_message,
    parse_record,
    split_chunk,
    split_records,
)
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import requested_ticks
from pbrg_mj.log.schema.message import LogMessage
from pbrg_mj.log.schema.protobuf import CLASSES
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.text import counted

FOOTER_SIZE = RECORD_PREFIX.size + 20  # two offsets and the checksum


@dataclass
class RepairReport:
    """What a repair found. Ticks are given by their first and last index."""

    damage: list[str] = field(default_factory=list)  # each in one line, in the file's order
    chunks: int = 0  # kept
    lost: int = 0  # chunks that were there, but not whole
    ticks: list[tuple[int, int]] = field(default_factory=list)  # runs of ticks without a gap

    @property
    def kept_ticks(self) -> int:
        """How many ticks the new log holds."""
        return sum(last - first + 1 for first, last in self.ticks)


def repair(path: Path, target: Path) -> RepairReport:
    """Write to `target` what is whole in the log at `path`, chunk by chunk; a whole log is copied byte for byte.

    Nothing is guessed: a chunk whose checksum fails is left out as a whole. Raises InputError when the file is not a
    log of this package, when what it embeds is lost, or when it holds no whole chunk.
    """
    with open_mcap(path) as (file, size), target.open("wb") as output, McapWriter(output).abandoned() as writer:
        copy = _Copy(writer, _index_channels(file, size), EmbeddedFiles(str(path)))
        file.seek(len(MAGIC))
        copy.copy_records(file, size)
        found = copy.found
        copy.embedded.header("; ".join(found.damage) or None)
        if not found.ticks:
            raise InputError(
                f"holds no whole tick ({'; '.join(found.damage) or 'the run never began'})", file=str(path)
            )
        if found.damage:
            writer.finish()
        else:
            writer.abandon()
            for one in (file, output):
                one.seek(0)
            output.truncate()
            copyfileobj(file, output)
    return found


class _Channel(NamedTuple):
    """A channel of the new log."""

    topic: str
    add_message: Callable[..., None]


@dataclass
class _Copy:
    """The clean log while it is written."""

    writer: McapWriter
    index: list[Schema | Channel]  # from the file's end: the only place left where the first chunk is lost
    embedded: EmbeddedFiles
    found: RepairReport = field(default_factory=RepairReport)
    schemas: dict[int, Schema] = field(default_factory=dict)  # by number in the old log
    channels: dict[int, _Channel] = field(default_factory=dict)  # likewise
    reached: int = -1  # time of the last tick kept [ns]
    ticks_left: int | None = None  # ticks that may still come by the scenario; known from the first chunk with ticks on

    def copy_records(self, file: BinaryIO, size: int) -> None:
        """Copy all that is whole, to the file's end or to where its records can no longer be separated."""
        crc = zlib.crc32(MAGIC)
        try:
            for opcode, prefix, body in split_records(file, size - len(MAGIC)):
                if opcode == Opcode.DATA_END:
                    self._end(file, crc, prefix, body)
                    return
                crc = zlib.crc32(body, zlib.crc32(prefix, crc))
                self._record(opcode, body)
            raise DamageError("the file ends before its end mark")
        except DamageError as damage:
            self.found.damage.append(str(damage))

    def _end(self, file: BinaryIO, crc: int, prefix: bytes, body: bytes) -> None:
        if parse_record(DataEnd, body).data_section_crc not in (0, crc) and not self.found.damage:
            raise DamageError("the checksum of the data does not match")
        check_end(file, prefix + body)

    def _record(self, opcode: int, body: bytes) -> None:
        """Copy one record of the file's own level, or note that it is damaged."""
        try:
            if opcode == Opcode.ATTACHMENT:
                self._attachment(parse_attachment(body))
            elif opcode == Opcode.METADATA:
                self._metadata(parse_record(Metadata, body))
            elif opcode == Opcode.CHUNK:
                self._chunk(body)
        except DamageError as damage:
            self.found.damage.append(str(damage))
            self.found.lost += opcode == Opcode.CHUNK

    def _attachment(self, one: Attachment) -> None:
        self.embedded.add(one)
        self.writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, one.data)

    def _metadata(self, one: Metadata) -> None:
        self.embedded.add(one)
        self.writer.add_metadata(one.name, one.metadata)

    def _chunk(self, body: bytes) -> None:
        """Copy a chunk, unless it cannot be trusted or repeats earlier ticks."""
        data = decompress_chunk(parse_record(Chunk, body))
        found = [(opcode, body) for opcode, _, body in split_chunk(data)]
        declared = _declared(found)
        messages = [_numbered(body) for opcode, body in found if opcode == Opcode.MESSAGE]
        if any(message.log_time <= self.reached for _, message in messages):
            raise DamageError("a chunk repeats earlier ticks")
        self._declare([*declared, *self.index])
        known = [(self.channels[number], message) for number, message in messages if number in self.channels]
        if messages and not known:
            raise DamageError("a message belongs to no channel")
        ticks = self._ticks([message.data for channel, message in known if channel.topic == channels.TICK])
        for channel, message in known:
            channel.add_message(message.data, log_time=message.log_time)
        self.writer.flush()
        for index in ticks:
            self._tick(index)
        self.reached = max((message.log_time for _, message in known), default=self.reached)
        self.found.chunks += 1
        if len(known) < len(messages):
            self.found.damage.append(f"{counted(len(messages) - len(known), 'message')} of no channel")

    def _ticks(self, found: list[bytes]) -> list[int]:
        """Return the ticks' indices. Before the first one, all that is embedded must be there and go together."""
        if not found:
            return []
        if self.ticks_left is None:
            self.ticks_left = requested_ticks(self.embedded.header("; ".join(self.found.damage) or None).scenario)
        if len(found) > self.ticks_left:
            raise DamageError("a chunk has ticks beyond the scenario's end")
        self.ticks_left -= len(found)
        return [_tick_index(data) for data in found]

    def _declare(self, records: Iterable[Schema | Channel]) -> None:
        """Add to the new log what the old one declares, unless it is known."""
        for one in records:
            if isinstance(one, Schema):
                self.schemas.setdefault(one.id, one)
            elif one.id not in self.channels and one.schema_id in self.schemas:
                schema = self.schemas[one.schema_id]
                add_message = self.writer.add_channel(one.topic, schema.name, schema.data)
                self.channels[one.id] = _Channel(one.topic, add_message)

    def _tick(self, index: int) -> None:
        runs = self.found.ticks
        if runs and runs[-1][1] == index - 1:
            runs[-1] = (runs[-1][0], index)
        else:
            runs.append((index, index))


def _numbered(body: bytes) -> tuple[int, LogMessage]:
    """Return a message, whose topic is not known yet, and its channel's number."""
    if len(body) < MESSAGE_PREFIX.size:
        raise DamageError("a message is cut")
    return MESSAGE_PREFIX.unpack_from(body)[0], parse_message("", body)


def _tick_index(data: bytes) -> int:
    try:
        return CLASSES["Tick"].FromString(data).index  # pyright: ignore[reportAttributeAccessIssue]
    except DecodeError as error:
        raise DamageError("a message on /tick cannot be read") from error


def _declared(records: Iterable[tuple[int, bytes]]) -> list[Schema | Channel]:
    """Return the schemas and channels among records, given by opcode and body."""
    found: list[Schema | Channel] = []
    for opcode, body in records:
        if opcode == Opcode.SCHEMA:
            found.append(parse_record(Schema, body))
        elif opcode == Opcode.CHANNEL:
            found.append(parse_record(Channel, body))
    return found


def _index_channels(file: BinaryIO, size: int) -> list[Schema | Channel]:
    """Return schemas and channels from the index at the file's end; none when it is not whole."""
    try:
        return _declared(_index_records(file, size))
    except DamageError:
        return []


def _index_records(file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    end = size - len(MAGIC)
    if end - FOOTER_SIZE < len(MAGIC):
        raise DamageError("there is no index")
    file.seek(end - FOOTER_SIZE)
    footer = parse_record(Footer, file.read(FOOTER_SIZE)[RECORD_PREFIX.size :])
    if not len(MAGIC) < footer.summary_start < end:
        raise DamageError("there is no index")
    file.seek(footer.summary_start)
    index = file.read(end - footer.summary_start)
    if zlib.crc32(index[:-4]) != footer.summary_crc:
        raise DamageError("the checksum of the index at the file's end does not match")
    yield from ((opcode, body) for opcode, _, body in split_records(BytesIO(index), len(index)))
