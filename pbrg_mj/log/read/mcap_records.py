"""MCAP's records off a file that may be cut or corrupted anywhere: checked, bounded, in order.

mcap's own readers trust the lengths they find and give up on a cut file. This one never reads or decompresses
more than a record can honestly hold, and says in one line what is wrong. https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema

from pbrg_mj.log.schema.message import Payload

MAGIC = b"\x89MCAP0\r\n"
LARGEST_CHUNK = 2**28  # bytes after decompression; a decompression bomb ends here
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

Record = TypeVar("Record", Attachment, Channel, Chunk, DataEnd, Footer, Metadata, Schema)


class Damage(Exception):
    """The file is not whole from here on; the text says why, in one line."""


def read_container(file: BinaryIO, size: int) -> Iterator[Attachment | Metadata | Payload]:
    """Yield what the log holds, in order; raise Damage where the file is not whole.

    `file` stands behind the leading magic, `size` is the whole file's length in bytes. A chunk's messages are
    yielded only when its checksum holds. The iteration ends normally only if every checksum does.
    """
    topics: dict[int, str] = {}
    crc = zlib.crc32(MAGIC)
    for opcode, head, body in records(file, size - len(MAGIC)):
        if opcode == Opcode.DATA_END:
            if parse(DataEnd, body).data_section_crc not in (0, crc):
                raise Damage("the checksum of the data does not match")
            check_end(file, head + body)
            return
        crc = zlib.crc32(body, zlib.crc32(head, crc))
        if opcode == Opcode.ATTACHMENT:
            yield checked_attachment(body)
        elif opcode == Opcode.METADATA:
            yield parse(Metadata, body)
        elif opcode == Opcode.CHUNK:
            yield from _messages(decompress(parse(Chunk, body)), topics)
    raise Damage("the file ends before its end mark")


def records(file: BinaryIO, left: int) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield opcode, head and body of the records in the next `left` bytes; raise Damage where they are cut."""
    while left > 0:
        head = file.read(RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size:
            raise Damage("the file ends inside a record")
        opcode, length = RECORD_HEAD.unpack(head)
        left -= RECORD_HEAD.size + length
        if left < 0:
            raise Damage("the file ends inside a record")
        yield opcode, head, file.read(length)


def parse(kind: type[Record], body: bytes) -> Record:
    """Return the record in `body`; raise Damage when there is none."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise Damage(f"a {kind.__name__} record cannot be read") from error


def checked_attachment(body: bytes) -> Attachment:
    """Return the attachment in `body`; raise Damage unless its checksum holds."""
    if zlib.crc32(body[:-4]).to_bytes(4, "little") != body[-4:]:
        raise Damage("the checksum of an attachment does not match")
    return parse(Attachment, body)


def decompress(chunk: Chunk) -> bytes:
    """Return a chunk's records; raise Damage unless its checksum holds."""
    size = chunk.uncompressed_size
    if chunk.compression != "zstd":
        raise Damage(f"a chunk is compressed with {chunk.compression!r:.20}, not with zstd")
    try:
        if size > LARGEST_CHUNK or zstandard.frame_content_size(chunk.data) != size:
            raise Damage("a chunk has an impossible size")
        data = zstandard.decompress(chunk.data)
    except (zstandard.ZstdError, MemoryError) as error:
        raise Damage("a chunk cannot be decompressed") from error
    if zlib.crc32(data) != chunk.uncompressed_crc:
        raise Damage("the checksum of a chunk does not match")
    return data


def _messages(data: bytes, topics: dict[int, str]) -> Iterator[Payload]:
    """Yield a chunk's messages; its channels are added to `topics`."""
    for opcode, _, body in records(BytesIO(data), len(data)):
        if opcode == Opcode.CHANNEL:
            channel = parse(Channel, body)
            topics[channel.id] = channel.topic
        elif opcode == Opcode.MESSAGE:
            channel_id = MESSAGE_HEAD.unpack_from(body)[0] if len(body) >= MESSAGE_HEAD.size else -1
            if channel_id not in topics:
                raise Damage("a message belongs to no channel")
            yield message_of(topics[channel_id], body)


def message_of(topic: str, body: bytes) -> Payload:
    """Return the message in a record's body, which is not shorter than MESSAGE_HEAD."""
    _, index, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
    return Payload(topic, body[MESSAGE_HEAD.size :], index, log_time, publish_time)


def check_end(file: BinaryIO, data_end: bytes) -> None:
    """Check the index behind the data. Nothing here reads it, but other readers do."""
    tail = file.read()
    footer_size = RECORD_HEAD.size + 20  # two offsets and the checksum
    index, end = tail[: -len(MAGIC)], tail[-len(MAGIC) :]
    if end != MAGIC or len(index) < footer_size:
        raise Damage("the index at the file's end is cut")
    footer = parse(Footer, index[RECORD_HEAD.size - footer_size :])
    if footer.summary_crc not in (0, zlib.crc32(index[:-4])):
        raise Damage("the checksum of the index at the file's end does not match")
