"""A log's messages, tick by tick, without ever holding the log."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, groupby
from pathlib import Path
from typing import BinaryIO

from pbrg_mj.log.read.header import Embedded, Head, opened
from pbrg_mj.log.read.mcap_records import Damage, read_container
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.message import Payload


class LoggedTicks:
    """An iterator over the groups of messages that belong to one tick, those on /timing left out.

    `file` stands behind MCAP's magic and must stay open. `damage` tells, after the last group, why the file ends early.
    Raises InputError when the file is not a log of this package.
    """

    def __init__(self, file: BinaryIO, size: int, path: str):
        self.damage: str | None = None
        self._embedded = Embedded(path)
        messages = self._messages(file, size)
        first = next(messages, None)  # everything embedded stands before it
        self.head: Head = self._embedded.head(self.damage)
        self.facts = self._embedded.metadata[channels.RUN_METADATA]
        rest = chain([first] if first else [], messages)
        self._groups = groupby(rest, key=lambda message: message.tick)

    def __iter__(self) -> Iterator[list[Payload]]:
        """Return the iterator itself: the messages pass by once."""
        return self

    def __next__(self) -> list[Payload]:
        """Return the next tick's messages."""
        return list(next(self._groups)[1])

    def _messages(self, file: BinaryIO, size: int) -> Iterator[Payload]:
        try:
            for item in read_container(file, size):
                if not isinstance(item, Payload):
                    self._embedded.keep(item)
                elif item.topic != channels.TIMING:
                    yield item
        except Damage as damage:
            self.damage = str(damage)


def read_header(path: Path) -> Head:
    """Return what a log embeds. Raises InputError when it is not a log of this package."""
    with opened(path) as (file, size):
        return LoggedTicks(file, size, str(path)).head
