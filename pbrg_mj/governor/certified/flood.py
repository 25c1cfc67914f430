"""Flooding: an item that one robot has made reaches every robot, link by link.

An item is a header (kind, robot, cycle) and a content whose size follows from its kind. Every robot passes on every
item of the present cycle, once, or more often where messages are lost.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

ITEM = struct.Struct("<BHI")  # kind, robot, cycle
COUNT = struct.Struct("<B")
Key = tuple[int, int]  # kind, robot


class ItemSize(NamedTuple):
    """How long the content of a kind of item is."""

    fixed: int  # [bytes]
    entry: int = 0  # of each of the entries that a count at the content's beginning tells; 0: there is no count


class Flood(NamedTuple):
    """One robot's part in the floods of a cycle."""

    cycle: int
    items: dict[Key, bytes]  # of this cycle: what arrived, and its own; with headers
    sent: dict[Key, int]  # how often each was passed on

    @classmethod
    def begin(cls, cycle: int) -> Flood:
        """Return the floods of a cycle before its first item."""
        return cls(cycle, {}, {})

    def content(self, kind: int, robot: int) -> bytes | None:
        """Return the content of an item; None unless it is known."""
        item = self.items.get((kind, robot))
        return None if item is None else item[ITEM.size :]

    def contents(self, kind: int, robots: int) -> list[bytes] | None:
        """Return the contents of a kind, robot by robot; None unless all of them are known."""
        found = [self.content(kind, robot) for robot in range(robots)]
        return [one for one in found if one is not None] if None not in found else None

    def with_item(self, kind: int, robot: int, content: bytes) -> Flood:
        """Return the floods with one item more."""
        item = ITEM.pack(kind, robot, self.cycle) + content
        return self._replace(items=self.items | {(kind, robot): item})

    def forwarded(self, repeats: int) -> tuple[bytes, Flood]:
        """Return the items that were not passed on so often yet, and the floods after it."""
        fresh = [key for key in sorted(self.items) if self.sent.get(key, 0) < repeats]
        if not fresh:
            return b"", self
        sent = self.sent | {key: self.sent.get(key, 0) + 1 for key in fresh}
        return b"".join(self.items[key] for key in fresh), self._replace(sent=sent)

    def received(self, contents: Iterable[bytes], sizes: Mapping[int, ItemSize]) -> Flood:
        """Return the floods with the items of this cycle that some messages brought."""
        found = dict(self.items)
        for content in contents:
            for key, cycle, item in _items(content, sizes):
                if cycle == self.cycle:
                    found.setdefault(key, item)
        return self if len(found) == len(self.items) else self._replace(items=found)


def _items(content: bytes, sizes: Mapping[int, ItemSize]) -> Iterator[tuple[Key, int, bytes]]:
    """Yield the items of a message: whose, of which cycle, header and content."""
    at = 0
    while at < len(content):
        kind, robot, cycle = ITEM.unpack_from(content, at)
        end = at + ITEM.size + sizes[kind].fixed
        if sizes[kind].entry:
            (count,) = COUNT.unpack_from(content, at + ITEM.size)
            end += COUNT.size + count * sizes[kind].entry
        yield (kind, robot), cycle, content[at:end]
        at = end
