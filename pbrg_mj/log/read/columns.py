"""Serialized messages of one kind turned into columns, a block at a time: no object for each message, or each value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pbrg_mj.log.read.column_store import Columns, ColumnStore
from pbrg_mj.log.read.layout import Layout
from pbrg_mj.log.schema.fields import MESSAGES, Dims, Field
from pbrg_mj.log.schema.protobuf import DTYPE

BLOCK_MESSAGES = 250  # that become columns at once, at most
BLOCK_BYTES = 2**23  # of them, or one message
MOST_LAYOUTS = 32  # of messages of one length

Reduce = Callable[[Columns], Columns]


@dataclass
class MessageColumns:
    """The messages of one kind that were read so far. `reduce` says what of each block of columns is kept."""

    name: str  # of the message in the table
    dims: Dims
    reduce: Reduce = dict
    count: int = 0
    absent: frozenset[str] = frozenset()  # fields that the log is too old to have
    _layouts: dict[int, list[Layout]] = field(default_factory=dict)  # by length of the message
    _block: list[tuple[Layout, bytes]] = field(default_factory=list)
    _waiting: int = 0  # bytes of the block
    _columns: ColumnStore = field(default_factory=ColumnStore)

    def add(self, data: bytes, first: int, last: int) -> int:
        """Take a message and return its tick's number.

        Raises ValueError when it cannot be read, IndexError when that number is not from `first` to `last`.
        """
        layout = self._layout(data)
        index = layout.index(data)
        if not first <= index <= last:
            raise IndexError(f"{index} is not from {first} to {last}")
        if not self.count:
            self.absent = layout.absent(self.name)
        self._block.append((layout, data))
        self._waiting += len(data)
        self.count += 1
        if len(self._block) == BLOCK_MESSAGES or self._waiting >= BLOCK_BYTES:
            self._end_block()
        return index

    def columns(self) -> ColumnStore:
        """Return the columns, (messages, ...); no message may follow."""
        if self._block or not self._columns:
            self._end_block()
        return self._columns

    def _layout(self, data: bytes) -> Layout:
        known = self._layouts.setdefault(len(data), [])
        for layout in known:
            if layout.fits(data):
                return layout
        layout = Layout.of(self.name, data, self.dims)
        known[:] = [layout, *known[: MOST_LAYOUTS - 1]]
        return layout

    def _end_block(self) -> None:
        """Make columns of the messages that wait."""
        columns = {one.name: self._empty(one) for one in MESSAGES[self.name]}
        for layout in {id(layout): layout for layout, _ in self._block}.values():
            rows = [row for row, (its, _) in enumerate(self._block) if its is layout]
            raw = np.frombuffer(b"".join([self._block[row][1] for row in rows]), np.uint8).reshape(len(rows), -1)
            for one in MESSAGES[self.name]:
                columns[one.name][rows] = layout.column(one, raw, self.dims)
        self._block.clear()
        self._waiting = 0
        for one in MESSAGES[self.name]:
            if one.kind == "text":
                columns[one.name] = columns[one.name].astype(DTYPE["text"])
        if kept := self.reduce(columns):
            self._columns.append(kept)

    def _empty(self, one: Field) -> np.ndarray:
        dtype = object if one.kind == "text" else DTYPE[one.kind]
        return np.empty((len(self._block), *one.extent(self.dims)), dtype)
