"""Where two serialized messages of one kind differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from math import isfinite, isnan
from struct import pack
from typing import Any

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import DecodeError, Message

Leaf = tuple[str, Any]
ABSENT = "nothing"


@dataclass(frozen=True)
class Difference:
    """A value in which two messages differ."""

    field: str  # with indices into arrays: m[3], entities[0].lines[1].points[2].x
    logged: str
    replayed: str
    size: float  # |logged - replayed|; inf where that makes no number


def differences(kind: type[Message], logged: bytes, replayed: bytes) -> Iterator[Difference]:
    """Yield what differs, in the fields' order; at least one difference when the bytes differ."""
    if logged == replayed:
        return
    try:
        pairs = zip_longest(_leaves(kind.FromString(logged)), _leaves(kind.FromString(replayed)))
    except DecodeError:
        yield Difference("the message", "bytes that are no such message", "a message", float("inf"))
        return
    found = False
    for ours, theirs in pairs:
        difference = _difference(ours, theirs)
        if difference is not None:
            found = True
            yield difference
        if ours is None or theirs is None or ours[0] != theirs[0]:
            return  # of different structure from here on
    if not found:
        yield Difference("the message", "the same values in other bytes", "", 0.0)


def _difference(logged: Leaf | None, replayed: Leaf | None) -> Difference | None:
    a, b = logged or (ABSENT, None), replayed or (ABSENT, None)
    if a[0] != b[0]:
        return Difference(b[0] if a[0] == ABSENT else a[0], _shown(logged, b[0]), _shown(replayed, a[0]), float("inf"))
    if _bits(a[1]) == _bits(b[1]):
        return None
    return Difference(a[0], _text(a[1], b[1]), _text(b[1], a[1]), _size(a[1], b[1]))


def _shown(leaf: Leaf | None, other: str) -> str:
    return ABSENT if leaf is None else f"{leaf[0]} = {leaf[1]!r}" if leaf[0] != other else repr(leaf[1])


def _leaves(message: Message, prefix: str = "") -> Iterator[Leaf]:
    """Yield path and value of every scalar, depth first; zeros, too, which protobuf does not count as set."""
    for field in message.DESCRIPTOR.fields:
        nested, value = field.type == FieldDescriptor.TYPE_MESSAGE, getattr(message, field.name)
        path = f"{prefix}{field.name}"
        if field.is_repeated:
            items = [(f"{path}[{k}]", one) for k, one in enumerate(value)]
        else:
            items = [(path, value)] if not nested or message.HasField(field.name) else []
        for item_path, one in items:
            if nested:
                yield from _leaves(one, f"{item_path}.")
            else:
                yield item_path, one


def _bits(value: Any) -> Any:
    return pack("<d", value) if isinstance(value, float) else value


def _text(value: Any, other: Any) -> str:
    """Return the value so that it differs from the other's text: two NaN may differ in their bits alone."""
    return repr(value) if repr(value) != repr(other) else f"{value!r} (0x{_bits(value)[::-1].hex()})"


def _size(a: Any, b: Any) -> float:
    if isinstance(a, bool) or not isinstance(a, int | float):
        return float("inf")
    if isnan(a) and isnan(b):
        return 0.0
    return float(abs(a - b)) if isfinite(a) and isfinite(b) else float("inf")
