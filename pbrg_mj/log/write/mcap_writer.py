"""Writing MCAP files: foxglove-sdk's compiled writer, with chunks that end where the log wants them to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import SEEK_CUR
from typing import BinaryIO, Self

import foxglove
from foxglove.mcap import MCAPCompression, MCAPWriteOptions


class McapWriter:
    """Writes an MCAP file, with every checksum and index, to `file`, which is empty and which the caller closes.

    A chunk ends only where `flush` is called, and is written whole: a kill costs what came since. The same calls make
    the same bytes. Messages are numbered by channel, from 1. All methods raise what `file` raises.
    """

    def __init__(self, file: BinaryIO):
        self._output = _Output(file)
        self._context = foxglove.Context()  # its channels are this file's alone
        options = MCAPWriteOptions(
            compression=MCAPCompression.Lz4, chunk_size=None, disable_seeking=True, compression_threads=0
        )
        with self._errors_of_file():
            self._writer = foxglove.open_mcap(self._output, context=self._context, writer_options=options)

    def add_attachment(self, create_time: int, log_time: int, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment, outside of chunks; times in ns."""
        with self._errors_of_file():
            self._writer.attach(create_time=create_time, log_time=log_time, name=name, media_type=media_type, data=data)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write metadata, outside of chunks."""
        with self._errors_of_file():
            self._writer.write_metadata(name, data)

    def add_channel(self, topic: str, schema_name: str, schema_data: bytes) -> Callable[..., None]:
        """Return what adds a message to the open chunk: call it with the data and `log_time` [ns].

        `schema_data` is the serialized FileDescriptorSet of the protobuf class `schema_name`. Channel and schema are
        written with the first message.
        """
        schema = foxglove.Schema(name=schema_name, encoding="protobuf", data=schema_data)
        return foxglove.Channel(topic, schema=schema, message_encoding="protobuf", context=self._context).log

    def flush(self) -> None:
        """End the open chunk, unless it is empty, and hand all that is written to the file."""
        with self._errors_of_file():
            self._writer.flush()

    def finish(self) -> None:
        """End the open chunk and write the summary; nothing may follow."""
        with self._errors_of_file():
            self._writer.close()

    def abandon(self) -> None:
        """Leave the file as it is, without the open chunk and the summary; nothing may follow."""
        self._output.close()
        with suppress(RuntimeError):  # after an error
            self._writer.close()

    @contextmanager
    def abandoned(self) -> Iterator[Self]:
        """Give the writer, and abandon what is not finished."""
        try:
            yield self
        finally:
            self.abandon()

    @contextmanager
    def _errors_of_file(self) -> Iterator[None]:
        """Raise what the file raised: the compiled writer turns it into a RuntimeError without the system's words."""
        try:
            yield
        except RuntimeError:
            if self._output.error is None:
                raise
            raise self._output.error from None


class _Output:
    """What the compiled writer writes to: appends, and keeps the file's first error, of whatever kind."""

    def __init__(self, file: BinaryIO):
        self._file: BinaryIO | None = file
        self._size = 0
        self.error: BaseException | None = None

    def write(self, data: bytes | bytearray) -> int:
        try:
            if self._file is not None:
                self._file.write(data)
        except BaseException as error:
            self.error = self.error or error
            raise
        self._size += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Return the position; the writer asks where it is, and never goes elsewhere."""
        if (offset, whence) not in ((0, SEEK_CUR), (self._size, 0)):
            raise OSError(f"cannot seek to {offset} from {whence}")
        return self._size

    def flush(self) -> None:
        try:
            if self._file is not None:
                self._file.flush()
        except BaseException as error:
            self.error = self.error or error
            raise

    def close(self) -> None:
        """Ignore what is written from now on."""
        self._file = None
