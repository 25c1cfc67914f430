"""MCAP's records from a file that may be cut or corrupted anywhere: checked, bounded, in order.

mcap's own readers trust the lengths they find and give up on a cut file. This one never reads or decompresses
more than a record can honestly hold, and says in one line what is wrong. https://mcap.dev/spec
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema

from pbrg_mj.log.schema.message import LogMessage

MAGIC = b"\x89MCAP0\r\n"
LARGEST_CHUNK = 2**28  # bytes after decompression; a decompression bomb ends here
LARGEST_RECORD = 2**28  # bytes; no log has one that comes near
MOST_IN_CHUNK = 250_000  # records; the writer ends a chunk at 8 MiB, or after a tick
RECORD_PREFIX = struct.Struct("<BQ")  # opcode, length
MESSAGE_PREFIX = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

Record = TypeVar("Record", Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema)


class DamageError(Exception):
    """The file is not whole from here on; the text says why, in one line."""


def read_records(file: BinaryIO, size: int) -> Iterator[Attachment | Metadata | LogMessage]:
    """Yield what the log holds, in order; raise DamageError where the file is not whole.

    `file` stands behind the leading magic, `size` is the whole file's length in bytes. A chunk's messages are
    yielded only when its checksum holds. The iteration ends normally only if every checksum does.
    """
    topics: dict[int, str] = {}
    crc = zlib.crc32(MAGIC)
    for opcode, prefix, body in split_records(file, size - len(MAGIC)):
        if opcode == Opcode.DATA_END:
            if parse_record(DataEnd, body).data_section_crc not in (0, crc):
                raise DamageError("the checksum of the data does not match")
            check_end(file, prefix + body)
            return
        crc = zlib.crc32(body, zlib.crc32(prefix, crc))
        if opcode == Opcode.ATTACHMENT:
            yield parse_attachment(body)
        elif opcode == Opcode.METADATA:
            yield parse_record(Metadata, body)
        elif opcode == Opcode.CHUNK:
            yield from _messages(decompress_chunk(parse_record(Chunk, body)), topics)
    raise DamageError("the file ends before its end mark")


def split_records(file: BinaryIO, left: int) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield opcode, prefix and body of the records in the next `left` bytes; raise DamageError where they are cut."""
    while left > 0:
        prefix = file.read(RECORD_PREFIX.size)
        if len(prefix) < RECORD_PREFIX.size:
            raise DamageError("the file ends inside a record")
        opcode, length = RECORD_PREFIX.unpack(prefix)
        left -= RECORD_PREFIX.size + length
        if left < 0:
            raise DamageError("the file ends inside a record")
        if length > LARGEST_RECORD:  # in a file with a hole in it, which has room for it
            raise DamageError("a record has an impossible size")
        yield opcode, prefix, file.read(length)


def split_chunk(data: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield opcode, prefix and body of the records in a chunk; raise DamageError where they are cut, or too many."""
    for count, record in enumerate(split_records(BytesIO(data), len(data))):
        if count == MOST_IN_CHUNK:
            raise DamageError(f"a chunk holds more than {MOST_IN_CHUNK} records")
        yield record


def parse_record(kind: type[Record], body: bytes) -> Record:
    """Return the record in `body`; raise DamageError when there is none."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise DamageError(f"a {kind.__name__} record cannot be read") from error


def parse_attachment(body: bytes) -> Attachment:
    """Return the attachment in `body`; raise DamageError unless its checksum holds."""
    if zlib.crc32(body[:-4]).to_bytes(4, "little") != body[-4:]:
        raise DamageError("the checksum of an attachment does not match")
    return parse_record(Attachment, body)


def decompress_chunk(chunk: Chunk) -> bytes:
    """Return a chunk's records; raise DamageError unless its checksum holds."""
    decompress = DECOMPRESS.get(chunk.compression)
    if decompress is None:
        raise DamageError(f"a chunk is compressed with {chunk.compression!r:.20}; allowed: {', '.join(DECOMPRESS)}")
    if chunk.uncompressed_size > LARGEST_CHUNK:
        raise DamageError("a chunk has an impossible size")
    try:
        data = decompress(chunk.data, chunk.uncompressed_size)
    except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
        raise DamageError("a chunk cannot be decompressed") from error
    if zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamageError("the checksum of a chunk does not match")
    return data


def _decompress_lz4(data: bytes, size: int) -> bytes:
    """Return what an LZ4 frame of `size` bytes holds, and no more than one byte beyond."""
    found = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    if len(found) != size:
        raise DamageError("a chunk has an impossible size")
    return found


def _decompress_zstd(data: bytes, size: int) -> bytes:
    """Return what a zstd frame of `size` bytes holds. Earlier logs have them, with the size in the frame."""
    if zstandard.frame_content_size(data) != size:
        raise DamageError("a chunk has an impossible size")
    return zstandard.decompress(data)


DECOMPRESS = {"lz4": _decompress_lz4, "zstd": _decompress_zstd}


def _messages(data: bytes, topics: dict[int, str]) -> Iterator[LogMessage]:
    """Yield a chunk's messages; its channels are added to `topics`."""
    for opcode, _, body in split_chunk(data):
        if opcode == Opcode.CHANNEL:
            channel = parse_record(Channel, body)
            topics[channel.id] = channel.topic
        elif opcode == Opcode.MESSAGE:
            channel_id = MESSAGE_PREFIX.unpack_from(body)[0] if len(body) >= MESSAGE_PREFIX.size else -1
            if channel_id not in topics:
                raise DamageError("a message belongs to no channel")
            yield parse_message(topics[channel_id], body)


def parse_message(topic: str, body: bytes) -> LogMessage:
    """Return the message in a record's body, which is not shorter than MESSAGE_PREFIX."""
    _, _, log_time, publish_time = MESSAGE_PREFIX.unpack_from(body)
    return LogMessage(topic, body[MESSAGE_PREFIX.size :], log_time, publish_time)


def check_end(file: BinaryIO, data_end: bytes) -> None:
    """Check the index behind the data. Nothing here reads it, but other readers do."""
    here = file.tell()
    left = file.seek(0, os.SEEK_END) - here
    file.seek(here)
    tail = file.read(min(left, LARGEST_RECORD))  # memory is taken for as much as is asked for
    footer_size = RECORD_PREFIX.size + 20  # two offsets and the checksum
    index, end = tail[: -len(MAGIC)], tail[-len(MAGIC) :]
    if end != MAGIC or len(index) < footer_size:
        raise DamageError("the index at the file's end is cut")
    footer = parse_record(Footer, index[RECORD_PREFIX.size - footer_size :])
    if footer.summary_crc not in (0, zlib.crc32(index[:-4])):
        raise DamageError("the checksum of the index at the file's end does not match")
