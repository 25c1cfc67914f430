"""A log's messages, tick by tick, without ever holding the log."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, groupby, islice
from pathlib import Path
from typing import BinaryIO

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.header import EmbeddedFiles, LogHeader, most_messages, open_mcap
from pbrg_mj.log.read.mcap_records import DamageError, read_records
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import Ending
from pbrg_mj.log.schema.message import NANOSECONDS, LogMessage


class LoggedTicks:
    """An iterator over the groups of messages that belong to one tick, those on /timing left out.

    `file` stands behind MCAP's magic and must stay open. After the last group, `damage` says why the file ends early.
    Raises InputError when the file is not a log of this package.
    """

    def __init__(self, file: BinaryIO, size: int, path: str):
        self.damage: str | None = None
        self.passed = 0  # groups so far
        self._path, self._embedded = path, EmbeddedFiles(path)
        messages = self._messages(file, size)
        first = next(messages, None)  # everything embedded stands before it
        self.header: LogHeader = self._embedded.header(self.damage)
        self.run_metadata = self._embedded.metadata[channels.RUN_METADATA]
        rest = chain([first] if first else [], messages)
        self._groups = groupby(rest, key=lambda message: message.log_time)

    @property
    def ending(self) -> Ending | None:
        """What the log says about its end; known after the last group."""
        return self._embedded.ending()

    def __iter__(self) -> Iterator[list[LogMessage]]:
        """Return the iterator itself: the messages pass by once."""
        return self

    def __next__(self) -> list[LogMessage]:
        """Return the next tick's messages."""
        most = most_messages(self.header.dims)
        time, messages = next(self._groups)
        group = list(islice(messages, most + 1))
        if len(group) > most:
            raise InputError(f"the log has more than {most} messages at {time / NANOSECONDS:.9g} s", file=self._path)
        self.passed += 1
        return group

    def _messages(self, file: BinaryIO, size: int) -> Iterator[LogMessage]:
        try:
            for item in read_records(file, size):
                if not isinstance(item, LogMessage):
                    self._embedded.add(item)
                elif item.topic != channels.TIMING:
                    yield item
        except DamageError as damage:
            self.damage = str(damage)


def read_header(path: Path) -> LogHeader:
    """Return what a log embeds. Raises InputError when it is not a log of this package."""
    with open_mcap(path) as (file, size):
        return LoggedTicks(file, size, str(path)).header
