"""An MCAP file taken apart into records, and put together again with the right checksums. https://mcap.dev/spec."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
PREFIX = struct.Struct("<BQ")  # opcode, length
CHUNK_HEAD = struct.Struct("<QQQI")  # first time, last time, size, checksum
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, ATTACHMENT, METADATA, DATA_END = 1, 2, 3, 4, 5, 6, 9, 12, 15
COMPRESS = {"lz4": lz4.frame.compress, "zstd": zstandard.compress, "": bytes}
DECOMPRESS = {"lz4": lz4.frame.decompress, "zstd": zstandard.decompress, "": bytes}


@dataclass
class Record:
    """A record outside of chunks, or inside."""

    opcode: int
    body: bytes
    length: int | None = None  # as declared, where that is a lie

    def bytes(self) -> bytes:
        """Return it as it lies in a file; an attachment with the right checksum."""
        body = (
            self.body[:-4] + struct.pack("<I", zlib.crc32(self.body[:-4])) if self.opcode == ATTACHMENT else self.body
        )
        return PREFIX.pack(self.opcode, len(body) if self.length is None else self.length) + body


@dataclass
class Chunk:
    """Records that are compressed together."""

    records: list[Record]
    compression: str
    size: int | None = None  # before compression as declared, where that is a lie

    def bytes(self) -> bytes:
        """Return it as it lies in a file, with the right checksum."""
        data = b"".join(record.bytes() for record in self.records)
        times = [
            MESSAGE_HEAD.unpack_from(one.body)[2]
            for one in self.records
            if one.opcode == MESSAGE and len(one.body) > 22
        ]
        size = len(data) if self.size is None else self.size
        head = CHUNK_HEAD.pack(min(times, default=0), max(times, default=0), size, zlib.crc32(data))
        packed = COMPRESS[self.compression](data)
        body = head + prefixed(self.compression.encode()) + struct.pack("<Q", len(packed)) + packed
        return Record(CHUNK, body).bytes()


Part = Record | Chunk


@dataclass
class File:
    """The data of a file, and the summary behind it, which is kept as it was."""

    parts: list[Part]
    summary: bytes = b""

    def bytes(self) -> bytes:
        """Return the file, all checksums right."""
        data = MAGIC + b"".join(part.bytes() for part in self.parts)
        end = Record(DATA_END, struct.pack("<I", zlib.crc32(data))).bytes()
        start = len(data) + len(end) if self.summary else 0
        index = self.summary + PREFIX.pack(FOOTER, 20) + struct.pack("<QQ", start, 0)
        return data + end + index + struct.pack("<I", zlib.crc32(index)) + MAGIC


def take_apart(content: bytes) -> File:
    """Return the parts of a whole file."""
    parts: list[Part] = []
    at = len(MAGIC)
    for one in split(content[len(MAGIC) : -len(MAGIC)]):
        at += PREFIX.size + len(one.body)
        if one.opcode == DATA_END:
            return File(parts, content[at : -len(MAGIC) - PREFIX.size - 20])
        parts.append(_chunk(one.body) if one.opcode == CHUNK else one)
    raise ValueError("no end of data")


def split(data: bytes) -> Iterator[Record]:
    """Yield the records that lie in a row."""
    at = 0
    while at < len(data):
        opcode, length = PREFIX.unpack_from(data, at)
        at += PREFIX.size + length
        yield Record(opcode, data[at - length : at])


def _chunk(body: bytes) -> Chunk:
    length = struct.unpack_from("<I", body, CHUNK_HEAD.size)[0]
    at = CHUNK_HEAD.size + 4
    compression = body[at : at + length].decode()
    return Chunk(list(split(DECOMPRESS[compression](body[at + length + 8 :]))), compression)


def prefixed(text: bytes) -> bytes:
    """Return a text behind its length."""
    return struct.pack("<I", len(text)) + text


def metadata(name: str, entries: Iterable[tuple[str, str]]) -> Record:
    """Return a metadata record; a name may be there twice."""
    pairs = b"".join(prefixed(key.encode()) + prefixed(value.encode()) for key, value in entries)
    return Record(METADATA, prefixed(name.encode()) + prefixed(pairs))


def metadata_entries(record: Record) -> tuple[str, list[tuple[str, str]]]:
    """Return the name and the entries of a metadata record."""
    name, rest = _unprefixed(record.body)
    pairs, _ = _unprefixed(rest)
    entries = []
    while pairs:
        key, pairs = _unprefixed(pairs)
        value, pairs = _unprefixed(pairs)
        entries.append((key.decode(), value.decode()))
    return name.decode(), entries


def attachment(name: str, data: bytes) -> Record:
    """Return an attachment."""
    body = struct.pack("<QQ", 0, 0) + prefixed(name.encode()) + prefixed(b"") + struct.pack("<Q", len(data)) + data
    return Record(ATTACHMENT, body + bytes(4))


def attachment_name(record: Record) -> str:
    """Return an attachment's name; empty if another accident made the record nonsense."""
    return _unprefixed(record.body[16:])[0].decode(errors="replace") if len(record.body) >= 20 else ""


def _unprefixed(data: bytes) -> tuple[bytes, bytes]:
    length = struct.unpack_from("<I", data)[0]
    return data[4 : 4 + length], data[4 + length :]
