"""The MCAP sink: one file per run, whole up to the last moments however the run ends."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.log.schema import channels
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.log.write.messages import MessageStream, dims_of, time_of
from pbrg_mj.log.write.provenance import add_channels, embed_provenance
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.load import Loaded

# A killed run loses its open chunk, so a chunk should last less than a second of WALL time. Its ends must not
# depend on the wall clock though, or the same run would not make the same file. So they are counted in SIMULATED
# time, short enough that even a run five times slower than real time loses a second at most. Against chunks of 1 s
# this costs 3 % in size and 4 % in time.
CHUNK_SECONDS = 0.2
CHUNK_BYTES = 8 * 2**20  # of many robots; bounds memory, and what a reader has to decompress at once


class LogWriter:
    """A context manager and a sink: call it with every TickRecord, in order.

    The file is created with the first record, so that a run that fails before leaves nothing behind. Messages
    carry simulated time. Raises InputError when the path cannot be written, PbrgError when the disk fails later.
    """

    def __init__(self, path: str | Path, loaded: Loaded, model_xml: str):
        self._path, self._loaded, self._model_xml = Path(path), loaded, model_xml
        self._ticks_per_chunk = max(1, round(CHUNK_SECONDS / loaded.scenario.timing.tick))
        self._file: BinaryIO | None = None
        self._buffer: list[TickRecord] = []
        self._ticks = self._bytes = 0  # in the open chunk
        self._tick_bytes = CHUNK_BYTES  # of the last tick written; before there is one, nothing is buffered
        self._between_records = True

    def __enter__(self) -> Self:
        """Refuse a path that cannot be written; nothing is created yet."""
        check_writable(self._path)
        return self

    def __call__(self, record: TickRecord) -> None:
        """Take one record; it reaches the disk with its chunk."""
        if self._file is None:
            self._start(record)
        self._buffer.append(record)
        ticks = len(self._buffer)
        if self._ticks + ticks >= self._ticks_per_chunk or self._bytes + ticks * self._tick_bytes >= CHUNK_BYTES:
            try:
                self._write_buffer()
            except OSError as error:
                raise self._failed(error) from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish and close the file, after Ctrl-C or an error as well."""
        if self._file is None:
            return
        try:
            with self._file:
                if self._between_records:
                    self._write_buffer()
                    self._writer.finish()
                else:  # interrupted inside a tick: leave the log as a kill would
                    self._writer.abandon()
        except OSError as failure:
            raise self._failed(failure) from failure

    def _start(self, first: TickRecord) -> None:
        try:
            self._file = self._path.open("wb")
        except OSError as error:
            raise InputError(f"cannot write {self._path}: {error.strerror}") from error
        try:
            self._writer = McapWriter(self._file)
            embed_provenance(self._writer, self._loaded, self._model_xml, dims_of(first))
            self._stream = MessageStream(self._loaded.scenario, first)
            self._channels = add_channels(self._writer, self._stream.types)
            self._writer.flush()
        except OSError as error:
            raise self._failed(error) from error

    def _write_buffer(self) -> None:
        """Write the buffered records: many in a row, while their code is in the processor's caches."""
        self._between_records = False
        for record in self._buffer:
            self._tick_bytes = self._add(record)
            self._ticks, self._bytes = self._ticks + 1, self._bytes + self._tick_bytes
            if self._ticks >= self._ticks_per_chunk or self._bytes >= CHUNK_BYTES:
                self._writer.flush()
                self._ticks = self._bytes = 0
        self._buffer.clear()
        self._between_records = True

    def _add(self, record: TickRecord) -> int:
        """Write one record; return the reproducible bytes it took before compression."""
        time_ns = time_of(record)
        messages = self._stream.serialize(record, time_ns)
        for topic, data in messages:
            self._channels[topic](data, log_time=time_ns)
        return sum([len(data) for topic, data in messages if topic != channels.TIMING])

    def _failed(self, error: OSError) -> PbrgError:
        """Close what is left of the file; `__exit__` then has nothing more to do."""
        if self._file is not None:
            self._writer.abandon()
            with suppress(OSError):
                self._file.close()
            self._file = None
        return PbrgError(f"cannot write {self._path}: {error.strerror or error}; the log ends there")


def check_writable(path: Path) -> None:
    """Raise InputError unless a file could be created or replaced at `path`."""
    folder = path.parent
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a folder")
    check_regular(path)
    if not folder.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {folder}")
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise InputError(f"cannot write {path}: permission denied")


def check_regular(path: Path) -> None:
    """Raise InputError for a pipe, which would wait for a reader, and for a device, whose place no file must take."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError("is a pipe or a device; allowed: a new name, or a file to replace", file=str(path))
