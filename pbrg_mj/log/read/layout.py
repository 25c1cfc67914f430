"""Where the values stand in a serialized message, found out once for all messages that differ in their values alone.

Such messages have the same bytes between the values: tags, lengths, texts. The first one is walked through; of the next
ones only those bytes are compared, which is what makes reading fast.
https://protobuf.dev/programming-guides/encoding/
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrg_mj.log.schema.fields import MESSAGES, Dims, Field
from pbrg_mj.log.schema.protobuf import DTYPE, FIXED64, LENGTH_DELIMITED

MOST_TEXT = 100  # characters; a column of texts has as much room in every row as its longest one takes
VARINT, FIXED32 = 0, 5  # the other wire types
LONGEST_VARINT = 10  # bytes


@dataclass(frozen=True)
class Layout:
    """Where the values stand in a message, and all its other bytes."""

    offsets: dict[str, int]  # of numbers and arrays
    texts: dict[str, str]
    other: int  # all bytes that are no values, as a number
    mask: int  # where they are

    @classmethod
    def of(cls, name: str, data: bytes, dims: Dims) -> Layout:
        """Return the layout of a message. Raises ValueError when it is not one of `name` with the table's shapes."""
        offsets: dict[str, int] = {}
        texts: dict[str, str] = {}
        mask, position = bytearray(b"\xff" * len(data)), 0
        while position < len(data):
            number, start, stop = _next_field(data, position)
            position = stop
            if number > len(MESSAGES[name]):  # of a later version
                mask[start:stop] = bytes(stop - start)
                continue
            one = MESSAGES[name][number - 1]
            if one.name in offsets or one.name in texts:
                raise ValueError(f"{one.name} is there twice")
            if one.kind == "text":
                texts[one.name] = _text(data[start:stop])
                continue
            if stop - start != one.count(dims) * DTYPE[one.kind].itemsize:
                raise ValueError(f"{one.name} has another shape")
            offsets[one.name] = start
            mask[start:stop] = (b"\xfe" if one.kind == "bool" else b"\0") * (stop - start)  # false and true: one bit
        _check_complete(name, {*offsets, *texts}, dims)
        where = int.from_bytes(mask, "little")
        other = int.from_bytes(data, "little") & where
        made = cls(offsets, texts, other, where)
        if any(data[k] > 1 for k in range(len(data)) if mask[k] == 0xFE):
            raise ValueError("a flag is neither false nor true")
        return made

    def fits(self, data: bytes) -> bool:
        """Tell whether a message of the same length has this layout."""
        return int.from_bytes(data, "little") & self.mask == self.other

    def index(self, data: bytes) -> int:
        """Return the tick's number, the first field of every message."""
        start = self.offsets.get("index")
        return 0 if start is None else int.from_bytes(data[start : start + 8], "little", signed=True)

    def absent(self, name: str) -> frozenset[str]:
        """Return the fields that the message is too old to have."""
        return frozenset(one.name for one in MESSAGES[name] if one.added and one.name not in self.offsets)

    def column(self, one: Field, raw: np.ndarray, dims: Dims) -> Any:
        """Return the values of a field in messages `raw` (messages, bytes): (messages, *shape), or one for all."""
        if one.kind == "text":
            return self.texts.get(one.name, "")
        start, dtype = self.offsets.get(one.name), DTYPE[one.kind]
        if start is None:
            return np.nan if one.added and one.kind == "double" else 0
        shape = one.extent(dims)
        values = np.ascontiguousarray(raw[:, start : start + one.count(dims) * dtype.itemsize]).view(dtype)
        return values.reshape(len(raw), *shape)


def _check_complete(name: str, there: Iterable[str], dims: Dims) -> None:
    """Raise ValueError unless all arrays are there; numbers and texts that are left out are zero and empty."""
    for one in MESSAGES[name]:
        if one.shape and one.count(dims) and one.name not in there and not one.added:
            raise ValueError(f"{one.name} is not there")


def _next_field(data: bytes, position: int) -> tuple[int, int, int]:
    """Return the number of the field at `position`, and where its value starts and ends."""
    tag, start = _varint(data, position)
    number, wire = tag >> 3, tag & 7
    if wire == VARINT:
        stop = _varint(data, start)[1]
    elif wire == LENGTH_DELIMITED:
        length, start = _varint(data, start)
        stop = start + length
    elif wire in (FIXED64, FIXED32):
        stop = start + (8 if wire == FIXED64 else 4)
    else:
        raise ValueError(f"wire type {wire}")
    if stop > len(data) or not number:
        raise ValueError("the message is cut")
    return number, start, stop


def _varint(data: bytes, position: int) -> tuple[int, int]:
    """Return the number at `position` in base 128, and where it ends."""
    value = 0
    for place, byte in enumerate(data[position : position + LONGEST_VARINT]):
        value |= (byte & 0x7F) << 7 * place
        if byte < 0x80:
            return value, position + place + 1
    raise ValueError("the message is cut")


def _text(data: bytes) -> str:
    text = data.decode()
    if len(text) > MOST_TEXT:
        raise ValueError(f"a text of {len(text)} characters")
    return text
