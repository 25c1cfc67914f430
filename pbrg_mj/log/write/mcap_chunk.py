"""The chunk of an MCAP file that is still being filled: messages and their index, packed in one go each.

mcap packs them one number at a time, which makes up most of a log's cost. https://mcap.dev/spec
"""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Iterable
from struct import Struct, pack
from typing import NamedTuple

import zstandard
from mcap.opcode import Opcode

MESSAGE = Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time; then the data
INDEX = Struct("<BQHI")  # opcode, length, channel, length of what follows: log time and offset of each message
CHUNK = Struct("<BQQQQII4sQ")  # opcode, length, first and last time, size, checksum, compression, size; then the data
CHUNK_INDEX = Struct("<BQQQQQI")  # opcode, length, times, offset and length of the chunk, length of what follows
CHUNK_INDEX_END = Struct("<QI4sQQ")  # length of all indices, compression, sizes compressed and not
# Packed in a third of an enumeration's time.
MESSAGE_OPCODE, INDEX_OPCODE = int(Opcode.MESSAGE), int(Opcode.MESSAGE_INDEX)
CHUNK_OPCODE, CHUNK_INDEX_OPCODE = int(Opcode.CHUNK), int(Opcode.CHUNK_INDEX)
COMPRESSION = b"zstd"
PREFIX = 9  # bytes of opcode and length, which a record's length does not count


class FinishedChunk(NamedTuple):
    """A chunk as a file holds it, and its entry in the file's index."""

    records: bytes  # the chunk, and where each channel's messages are in it
    index_entry: bytes  # the record at the file's end
    times: tuple[int, int]  # of the earliest and the latest message
    counts: dict[int, int]  # messages of each channel


class ChunkBuilder:
    """Records that wait to be compressed together, and where the messages among them are."""

    def __init__(self) -> None:
        self._data = bytearray()
        # channel -> log time and offset of each message, in turn
        self._places: defaultdict[int, list[int]] = defaultdict(list)

    def add_record(self, data: bytes) -> None:
        """Append a record that is no message."""
        self._data += data

    def add_messages(
        self, messages: Iterable[tuple[int, bytes]], log_time: int, publish_time: int, sequence: int
    ) -> None:
        """Append messages of one moment: channel and data of each."""
        chunk, places = self._data, self._places
        for channel, data in messages:
            places[channel] += log_time, len(chunk)
            length = MESSAGE.size - PREFIX + len(data)
            chunk += MESSAGE.pack(MESSAGE_OPCODE, length, channel, sequence, log_time, publish_time)
            chunk += data

    def finish(self, compressor: zstandard.ZstdCompressor, offset: int) -> FinishedChunk | None:
        """Return the chunk at byte `offset` of the file; None without a message: schemas and channels stay."""
        if not self._places:
            return None
        stamps = [time for places in self._places.values() for time in places[::2]]
        times = min(stamps), max(stamps)
        chunk, sizes = self._chunk(compressor, times)
        indices, offsets = self._indices(offset + len(chunk))
        index = _chunk_index(times, sizes, (offset, len(chunk)), (offsets, len(indices)))
        counts = {channel: len(places) // 2 for channel, places in self._places.items()}
        return FinishedChunk(chunk + indices, index, times, counts)

    def _chunk(self, compressor: zstandard.ZstdCompressor, times: tuple[int, int]) -> tuple[bytes, tuple[int, int]]:
        """Return the chunk's record, and the sizes of its data compressed and not."""
        data, size = compressor.compress(self._data), len(self._data)
        length, checksum = CHUNK.size - PREFIX + len(data), zlib.crc32(self._data)
        prefix = CHUNK.pack(CHUNK_OPCODE, length, *times, size, checksum, len(COMPRESSION), COMPRESSION, len(data))
        return prefix + data, (len(data), size)

    def _indices(self, offset: int) -> tuple[bytes, list[int]]:
        """Return the message indices at `offset`; each channel and its record's offset."""
        records, offsets = [], []
        for channel, places in self._places.items():
            size = 8 * len(places)
            prefix = INDEX.pack(INDEX_OPCODE, INDEX.size - PREFIX + size, channel, size)
            records += prefix, pack(f"<{len(places)}Q", *places)
            offsets += channel, offset
            offset += INDEX.size + size
        return b"".join(records), offsets


def _chunk_index(
    times: tuple[int, int], sizes: tuple[int, int], place: tuple[int, int], indices: tuple[list[int], int]
) -> bytes:
    """Return the chunk's entry in the file's index: where it and its message indices are, and how large."""
    offsets, indices_length = indices
    where = pack("<" + "HQ" * (len(offsets) // 2), *offsets)
    end = CHUNK_INDEX_END.pack(indices_length, len(COMPRESSION), COMPRESSION, *sizes)
    length = CHUNK_INDEX.size - PREFIX + len(where) + len(end)
    return CHUNK_INDEX.pack(CHUNK_INDEX_OPCODE, length, *times, *place, len(where)) + where + end
