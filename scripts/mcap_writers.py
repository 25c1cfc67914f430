"""Compare the log's own MCAP writer with those of libraries: time, size, determinism, sequence numbers, errors.

python scripts/mcap_writers.py    # some minutes; needs foxglove-sdk

Writers take turns within this process, over the same ticks of the same run (that of scripts/perf, with beams on all
robots and the reference at every tick), and end their chunks at the same ticks. Times are CPU times of the
process, so a busy machine does little to their ratios.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any, BinaryIO, Protocol

import foxglove
from foxglove.mcap import MCAPCompression, MCAPWriteOptions
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from pbrg_mj.log.write import writer as log_writer
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from performance.closed_loop import scenario

REPEATS = 15
TICKS = 400
OWN = "own, zstd -3"
NEVER = 2**62  # a library ends no chunk by itself


class Makes(Protocol):
    """What makes a writer of a file."""

    def __call__(self, file: BinaryIO) -> Any: ...


class OfMcap(Writer):
    """mcap's own Writer, with the method for a tick's messages."""

    def __init__(self, file: BinaryIO, compression: CompressionType):
        super().__init__(file, chunk_size=NEVER, compression=compression, enable_data_crcs=True)
        self.start(library="pbrg_mj")
        self._file = file

    def add_messages(self, messages: Iterable[tuple[int, bytes]], log_time: int, publish_time: int, sequence: int):
        for channel, data in messages:
            self.add_message(channel, log_time, data, publish_time, sequence)

    def flush(self) -> None:
        super().flush()
        self._file.flush()


class OfSdk:
    """foxglove-sdk's compiled writer. It numbers the messages of each channel itself, from 1."""

    def __init__(self, file: BinaryIO, **options: Any):
        self._context = foxglove.Context()
        # A chunk is written in one go when it ends: a kill leaves no half of one behind.
        fixed = {"chunk_size": None, "disable_seeking": True, "compression_threads": 0}
        self._writer = foxglove.open_mcap(
            file, context=self._context, writer_options=MCAPWriteOptions(**fixed, **options)
        )
        self._schemas: list[foxglove.Schema] = []
        self._log: list[Callable[..., None]] = []

    def add_attachment(self, create_time: int, log_time: int, name: str, media_type: str, data: bytes) -> None:
        self._writer.attach(log_time=log_time, create_time=create_time, name=name, media_type=media_type, data=data)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        self._writer.write_metadata(name, data)

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        self._schemas.append(foxglove.Schema(name=name, encoding=encoding, data=data))
        return len(self._schemas) - 1

    def register_channel(self, topic: str, message_encoding: str, schema_id: int, metadata: dict[str, str]) -> int:
        schema = self._schemas[schema_id]
        channel = foxglove.Channel(topic, schema=schema, message_encoding=message_encoding, context=self._context)
        self._log.append(channel.log)
        return len(self._log) - 1

    def add_messages(self, messages: Iterable[tuple[int, bytes]], log_time: int, publish_time: int, sequence: int):
        for channel, data in messages:
            self._log[channel](data, log_time=log_time)

    def flush(self) -> None:
        self._writer.flush()

    def finish(self) -> None:
        self._writer.close()


WRITERS: dict[str, Makes] = {
    OWN: McapWriter,
    "mcap, zstd 3": lambda file: OfMcap(file, CompressionType.ZSTD),
    "mcap, lz4": lambda file: OfMcap(file, CompressionType.LZ4),
    "foxglove-sdk, zstd 1": lambda file: OfSdk(file, compression_level=1),
    "foxglove-sdk, lz4": lambda file: OfSdk(file, compression=MCAPCompression.Lz4),
}
