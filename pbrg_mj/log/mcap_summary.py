"""What an MCAP file tells about itself at its end: all schemas and channels, statistics, and where everything is."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)


@dataclass
class McapSummary:
    """Grows with the file."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    message_counts: dict[int, int] = field(default_factory=dict)  # by channel

    def count(self, messages: dict[int, int]) -> None:
        """Take so many more messages of each channel into account."""
        for channel, number in messages.items():
            self.message_counts[channel] = self.message_counts.get(channel, 0) + number

    def encoded(self, start: int) -> bytes:
        """Return the summary and the footer of a file in which they begin at byte `start`."""
        summary = RecordBuilder()
        offsets = self._write_groups(summary, start)
        footer = Footer(summary_start=start, summary_offset_start=start + summary.count, summary_crc=0)
        for offset in offsets:
            offset.write(summary)
        data = summary.end()
        footer.summary_crc = zlib.crc32(encoded(footer)[:-4], zlib.crc32(data))  # of all but itself
        return data + encoded(footer)

    def _write_groups(self, summary: RecordBuilder, start: int) -> list[SummaryOffset]:
        """Write the records, group by group; return where the groups are in the file."""
        groups: tuple[tuple[int, Sequence[McapRecord]], ...] = (
            (Opcode.SCHEMA, self.schemas),
            (Opcode.CHANNEL, self.channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self.chunks),
            (Opcode.ATTACHMENT_INDEX, self.attachments),
            (Opcode.METADATA_INDEX, self.metadata),
        )
        offsets = []
        for opcode, records in groups:
            before = summary.count
            for record in records:
                record.write(summary)
            offsets.append(SummaryOffset(opcode, start + before, summary.count - before))
        return offsets

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self.message_counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.message_counts.values()),
            metadata_count=len(self.metadata),
            message_start_time=min((chunk.message_start_time for chunk in self.chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in self.chunks), default=0),
            schema_count=len(self.schemas),
        )


def encoded(record: McapRecord) -> bytes:
    """Return one record as mcap writes it."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
