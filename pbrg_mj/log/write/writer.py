"""The MCAP sink: one file per run, whole up to the last moments however the run ends."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

from pbrg_mj.errors import ShortageError
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import Ending
from pbrg_mj.log.write.log_file import LogFile
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.log.write.messages import MessageStream, dims_of, time_of
from pbrg_mj.log.write.provenance import add_channels, embed_provenance
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.plugins import is_centralized
from pbrg_mj.scenario.load import LoadedScenario

# A killed run loses its open chunk, so a chunk should last less than a second of WALL time. Its ends must not
# depend on the wall clock though, or the same run would not make the same file. So they are counted in SIMULATED
# time, short enough that even a run five times slower than real time loses a second at most. Against chunks of 1 s
# this costs 3 % in size and 4 % in time.
CHUNK_SECONDS = 0.2
CHUNK_BYTES = 8 * 2**20  # of many robots; bounds memory, and what a reader has to decompress at once


class LogWriter:
    """A context manager and a sink: call it with every TickRecord, in order.

    The log gets its own name when it is finished, until then it is at `partial_path` and locked. A run that fails
    before the first record leaves nothing behind. Messages carry simulated time. `force` allows to replace a log.

    `centralized` says whether the governor sees the whole team; None: as its name in the scenario says. `processes`:
    whether the robots' programs run in processes of their own.

    Raises InputError when the path cannot be written or another run writes it, ShortageError when the disk fails later.
    """

    def __init__(
        self,
        path: str | Path,
        loaded: LoadedScenario,
        model_xml: str,
        *,
        force: bool = False,
        centralized: bool | None = None,
        processes: bool = False,
    ):
        kind = loaded.scenario.governor.kind
        self._centralized = is_centralized(kind) if centralized is None else centralized
        self._processes = processes
        self.path, self._loaded, self._model_xml = Path(path), loaded, model_xml
        self._log_file = LogFile(self.path, force=force)
        self._ticks_per_chunk = max(1, round(CHUNK_SECONDS / loaded.scenario.timing.tick))
        self._writer: McapWriter | None = None  # from the first record on, until the log is closed
        self._buffer: list[TickRecord] = []
        self._written = 0  # ticks in all
        self._ticks = self._bytes = 0  # in the open chunk
        self._tick_bytes = CHUNK_BYTES  # of the last tick written; before there is one, nothing is buffered
        self._between_records = True

    def __enter__(self) -> Self:
        """Take the file."""
        self._file = self._log_file.open()
        return self

    def __call__(self, record: TickRecord) -> None:
        """Take one record; it reaches the disk with its chunk."""
        if self._writer is None:
            self._writer = self._start(record)
        self._buffer.append(record)
        ticks = len(self._buffer)
        if self._ticks + ticks >= self._ticks_per_chunk or self._bytes + ticks * self._tick_bytes >= CHUNK_BYTES:
            try:
                self._write_buffer(self._writer)
            except OSError as error:
                raise self._failed(self._writer, error) from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the file and move it into place, after Ctrl-C or an error as well; it then says why it ends."""
        if self._writer is None:
            if not self._file.closed:
                self._log_file.discard()
            return
        try:
            if self._between_records:
                self._finish(self._writer, error)
        except OSError as failure:
            raise self._failed(self._writer, failure) from failure
        finally:  # of a log interrupted inside a tick, that leaves what a kill would
            if self._writer is not None:
                self._writer.abandon()
                self._log_file.close_partial()

    def _finish(self, writer: McapWriter, error: BaseException | None) -> None:
        self._write_buffer(writer)
        ending = Ending.of(error, self._written, self._loaded.scenario)
        writer.add_metadata(channels.ENDING_METADATA, ending.as_metadata())
        writer.finish()
        self._log_file.keep()
        self._writer = None

    def _start(self, first: TickRecord) -> McapWriter:
        writer = McapWriter(self._file)
        try:
            governor = self._centralized, self._processes
            embed_provenance(writer, self._loaded, self._model_xml, dims_of(first), *governor)
            self._stream = MessageStream(self._loaded.scenario, first)
            self._channels = add_channels(writer, self._stream.types)
            writer.flush()
        except OSError as error:
            writer.abandon()
            self._log_file.discard()
            raise ShortageError(f"cannot write {self.path}: {error.strerror or error}") from error
        return writer

    def _write_buffer(self, writer: McapWriter) -> None:
        """Write the buffered records: many in a row, while their code is in the processor's caches."""
        self._between_records = False
        for record in self._buffer:
            self._tick_bytes = self._add(record)
            self._written += 1
            self._ticks, self._bytes = self._ticks + 1, self._bytes + self._tick_bytes
            if self._ticks >= self._ticks_per_chunk or self._bytes >= CHUNK_BYTES:
                writer.flush()
                self._ticks = self._bytes = 0
        self._buffer.clear()
        self._between_records = True

    def _add(self, record: TickRecord) -> int:
        """Write one record; return the reproducible bytes it took before compression."""
        time_ns = time_of(record)
        reproducible = 0
        for topic, data in self._stream.serialize(record, time_ns):
            self._channels[topic](data, log_time=time_ns)
            if topic != channels.TIMING:
                reproducible += len(data)
        return reproducible

    def _failed(self, writer: McapWriter, error: OSError) -> ShortageError:
        """Close what is left of the file; `__exit__` then has nothing more to do."""
        writer.abandon()
        self._log_file.close_partial()
        self._writer = None
        kept = f"what is whole is in {self._log_file.partial}, of which `pbrg repair` makes a log"
        return ShortageError(f"cannot write {self.path}: {error.strerror or error}; {kept}")
