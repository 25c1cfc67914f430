"""From the table of fields to protobuf: message classes, and an encoder that copies whole arrays.

Arrays are flat (C order) packed repeated fields, integers sfixed64: both are the array's own little-endian
bytes behind a tag and a length, so that encoding is exact and costs microseconds.
https://protobuf.dev/programming-guides/encoding/
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from operator import attrgetter
from struct import Struct
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

from pbrg_mj.log.schema.fields import MESSAGES, Dims, Field, Kind

PROTO_TYPE: dict[Kind, FieldDescriptorProto.Type.ValueType] = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "int": FieldDescriptorProto.TYPE_SFIXED64,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "text": FieldDescriptorProto.TYPE_STRING,
}
DTYPE: dict[Kind, np.dtype] = {
    "double": np.dtype("<f8"),
    "int": np.dtype("<i8"),
    "bool": np.dtype("?"),
    "text": np.dtype("U"),
}
CODE = {"double": "d", "int": "q"}  # of struct
REPEATED, SINGULAR = FieldDescriptorProto.LABEL_REPEATED, FieldDescriptorProto.LABEL_OPTIONAL
FIXED64, LENGTH_DELIMITED = 1, 2  # wire types


def message_classes() -> dict[str, type[Message]]:
    """Return the protobuf class of each message in the table, e.g. `pbrg.Tick` under "Tick"."""
    file = FileDescriptorProto(name="pbrg/log.proto", package="pbrg", syntax="proto3")
    for name, fields in MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, field in enumerate(fields, start=1):
            message.field.add(
                name=field.name,
                number=number,
                type=PROTO_TYPE[field.kind],
                label=REPEATED if field.shape else SINGULAR,
            )
    pool = DescriptorPool()
    pool.Add(file)
    return {name: GetMessageClass(pool.FindMessageTypeByName(f"pbrg.{name}")) for name in MESSAGES}


CLASSES = message_classes()


def varint(value: int) -> bytes:
    """Return a non-negative integer in base 128, least significant group first."""
    groups = bytearray()
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    groups.append(value)
    return bytes(groups)


def encoder(name: str, dims: Dims) -> Callable[[Any], bytes]:
    """Return a function from a TickRecord to the serialized message `name`.

    Arrays must be of the table's kinds, as a record's are. The function raises ValueError when one does not have the
    shape of the table. A message's fields may come in any order: arrays stand first, then numbers, which are packed in
    one go, then texts.
    """
    numbered = list(enumerate(MESSAGES[name], start=1))
    arrays = [(number, field) for number, field in numbered if field.shape]
    texts = [(number, field) for number, field in numbered if field.kind == "text"]
    numbers = [one for one in numbered if one not in arrays and one not in texts]
    values = attrgetter(*(field.source for _, field in (*arrays, *numbers, *texts)))
    array_tags, number_tags, text_tags = (
        [_tag(number, field, dims) for number, field in some] for some in (arrays, numbers, texts)
    )
    blank_arrays = [piece for tag in array_tags for piece in (tag, b"")]
    blank_numbers = [piece for tag in number_tags for piece in (tag, 0)]
    codes = [f"{len(tag)}s{CODE[field.kind]}" for tag, (_, field) in zip(number_tags, numbers, strict=True)]
    pack = Struct("<" + "".join(codes)).pack
    expected = sum(map(len, array_tags)) + sum(_size(field, dims) for _, field in arrays)
    first, last = len(arrays), len(arrays) + len(numbers)

    def encode(record: Any) -> bytes:
        found, pieces, packed = values(record), blank_arrays.copy(), blank_numbers.copy()
        packed[1::2] = found[first:last]
        if not first and last == len(found):  # numbers alone
            return pack(*packed)
        pieces[1::2] = found[:first]
        data = _joined(pieces)
        # Records have the right shapes, so one comparison covers all fields; only a failure looks at each.
        if len(data) != expected:
            for (_, field), value in zip(arrays, found[:first], strict=True):
                _check(field, value, dims)
        packed_texts = [tag + _pack_text(text) for tag, text in zip(text_tags, found[last:], strict=True)]
        return b"".join([data, pack(*packed), *packed_texts])

    return encode


def _joined(pieces: list[Any]) -> bytes:
    """Return bytes and arrays in a row: arrays as they lie in memory, if that is C order, at two thirds of the time."""
    try:
        return b"".join(pieces)
    except TypeError:  # an array in another order is no buffer
        return b"".join([piece if isinstance(piece, bytes) else piece.tobytes() for piece in pieces])


def _size(field: Field, dims: Dims) -> int:
    return field.count(dims) * DTYPE[field.kind].itemsize


def _tag(number: int, field: Field, dims: Dims) -> bytes:
    """Return the tag before a field's value, and an array's length in bytes; a text's length changes with it."""
    if field.kind == "text":
        return varint(number << 3 | LENGTH_DELIMITED)
    if not field.shape:
        return varint(number << 3 | FIXED64)
    return packed_tag(number, _size(field, dims))


def packed_tag(number: int, size: int) -> bytes:
    """Return tag and length of a packed array of `size` bytes that is field `number` of its message."""
    return varint(number << 3 | LENGTH_DELIMITED) + varint(size)


@lru_cache(maxsize=100)
def _pack_text(value: str) -> bytes:
    data = value.encode()
    return varint(len(data)) + data


def _check(field: Field, value: Any, dims: Dims) -> None:
    if np.shape(value) != field.extent(dims):
        raise ValueError(f"{field.name}: shape {np.shape(value)}, not {field.extent(dims)}")


def absent_fields(name: str, data: bytes) -> frozenset[str]:
    """Return the names of the fields that a serialized message is too old to have. Raises the runtime's DecodeError."""
    message = CLASSES[name].FromString(data)
    return frozenset(field.name for field in MESSAGES[name] if field.added and not len(getattr(message, field.name)))
