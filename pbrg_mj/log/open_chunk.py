"""The chunk of an MCAP file that is still being filled: messages and their index, packed in one go each.

mcap packs them one number at a time, which makes up most of a log's cost. https://mcap.dev/spec
"""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Iterator
from struct import Struct, pack

import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk

MESSAGE = Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time; then the data
INDEX = Struct("<BQHI")  # opcode, length, channel, length of what follows: log time and offset of each message
# Packed in a third of an enumeration's time.
MESSAGE_OPCODE, INDEX_OPCODE = int(Opcode.MESSAGE), int(Opcode.MESSAGE_INDEX)
HEAD = 9  # bytes of opcode and length, which a record's length does not count


class OpenChunk:
    """Records that wait to be compressed together, and where the messages among them are."""

    def __init__(self) -> None:
        self._data = bytearray()
        # channel -> log time and offset of each message, in turn
        self._places: defaultdict[int, list[int]] = defaultdict(list)

    def add_record(self, data: bytes) -> None:
        """Append a record that is no message."""
        self._data += data

    def add_message(self, channel_id: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append a message."""
        self._places[channel_id] += log_time, len(self._data)
        length = MESSAGE.size - HEAD + len(data)
        self._data += MESSAGE.pack(MESSAGE_OPCODE, length, channel_id, sequence, log_time, publish_time)
        self._data += data

    def compressed(self, compressor: zstandard.ZstdCompressor) -> Chunk:
        """Return the records as a file holds them; there must be a message among them."""
        times = [places[::2] for places in self._places.values()]
        return Chunk(
            compression="zstd",
            data=compressor.compress(self._data),
            message_start_time=min(map(min, times)),
            message_end_time=max(map(max, times)),
            uncompressed_crc=zlib.crc32(self._data),
            uncompressed_size=len(self._data),
        )

    def counts(self) -> dict[int, int]:
        """Return how many messages each channel has, in the order in which channels began."""
        return {channel: len(places) // 2 for channel, places in self._places.items()}

    def index(self) -> Iterator[tuple[int, bytes]]:
        """Yield each channel and the record that tells where its messages are in the chunk, likewise."""
        for channel, places in self._places.items():
            size = 8 * len(places)
            head = INDEX.pack(INDEX_OPCODE, INDEX.size - HEAD + size, channel, size)
            yield channel, head + pack(f"<{len(places)}Q", *places)
