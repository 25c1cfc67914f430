"""The summary at an MCAP file's end: all schemas and channels, statistics, and where everything is."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from pbrg_mj.log.write.mcap_chunk import FinishedChunk


@dataclass
class McapSummary:
    """Grows with the file, by two hundred bytes a chunk."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    _chunk_indices: bytearray = field(default_factory=bytearray)
    _chunk_count: int = 0
    _times: tuple[int, int] | None = None  # of the earliest and the latest message
    _message_counts: dict[int, int] = field(default_factory=dict)  # by channel

    def add_chunk(self, chunk: FinishedChunk) -> None:
        """Take a chunk into account."""
        self._chunk_indices += chunk.index_entry
        self._chunk_count += 1
        first, last = self._times or chunk.times
        self._times = min(first, chunk.times[0]), max(last, chunk.times[1])
        for channel, number in chunk.counts.items():
            self._message_counts[channel] = self._message_counts.get(channel, 0) + number

    def encoded(self, start: int) -> bytes:
        """Return the summary and the footer of a file in which they begin at byte `start`."""
        data, offsets = bytearray(), []
        for opcode, group in self._groups():
            offsets.append(SummaryOffset(opcode, start + len(data), len(group)))
            data += group
        footer = Footer(summary_start=start, summary_offset_start=start + len(data), summary_crc=0)
        data += _all_encoded(offsets)
        footer.summary_crc = zlib.crc32(encoded(footer)[:-4], zlib.crc32(data))  # of all but itself
        return bytes(data) + encoded(footer)

    def _groups(self) -> tuple[tuple[int, bytes | bytearray], ...]:
        return (
            (Opcode.SCHEMA, _all_encoded(self.schemas)),
            (Opcode.CHANNEL, _all_encoded(self.channels)),
            (Opcode.STATISTICS, encoded(self._statistics())),
            (Opcode.CHUNK_INDEX, self._chunk_indices),
            (Opcode.ATTACHMENT_INDEX, _all_encoded(self.attachments)),
            (Opcode.METADATA_INDEX, _all_encoded(self.metadata)),
        )

    def _statistics(self) -> Statistics:
        first, last = self._times or (0, 0)
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self._message_counts,
            chunk_count=self._chunk_count,
            message_count=sum(self._message_counts.values()),
            metadata_count=len(self.metadata),
            message_start_time=first,
            message_end_time=last,
            schema_count=len(self.schemas),
        )


def encoded(record: McapRecord) -> bytes:
    """Return one record as mcap writes it."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _all_encoded(records: Sequence[McapRecord]) -> bytes:
    return b"".join(map(encoded, records))
