"""From the table of fields to protobuf: message classes, and an encoder that copies whole arrays.

Arrays are flat (C order) packed repeated fields, integers sfixed64: both are the array's own little-endian
bytes behind a tag and a length, so that encoding is exact and costs microseconds.
https://protobuf.dev/programming-guides/encoding/
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from struct import Struct
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

from pbrg_mj.log.fields import MESSAGES, Dims, Field, Kind

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
SCALAR = {"double": Struct("<d"), "int": Struct("<q")}
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
    """Return a function from a TickRecord to the serialised message `name`.

    Arrays must be of the table's kinds, as a record's are. The function raises ValueError when one does not have the
    shape of the table.
    """
    fields = MESSAGES[name]
    values = attrgetter(*(field.source for field in fields))
    packers = [_packer(field) for field in fields]
    heads = [_head(number, field, dims) for number, field in enumerate(fields, start=1)]
    blank = [piece for head in heads for piece in (head, b"")]
    sizes = [field.count(dims) * DTYPE[field.kind].itemsize for field in fields]
    expected = sum(map(len, heads)) + sum(sizes)  # but for texts, whose items have no size of their own
    texts = [2 * place + 1 for place, field in enumerate(fields) if field.kind == "text"]

    def encode(record: Any) -> bytes:
        found, pieces = values(record), blank.copy()
        pieces[1::2] = [pack(value) for pack, value in zip(packers, found, strict=True)]
        data = b"".join(pieces)
        # One comparison of everything, for records are right; only then field by field.
        if len(data) != expected + sum(len(pieces[place]) for place in texts):
            for field, value in zip(fields, found, strict=True):
                _check(field, value, dims)
        return data

    return encode


def _head(number: int, field: Field, dims: Dims) -> bytes:
    """Return what stands before a field's value, without the length of a text."""
    if field.kind == "text":
        return varint(number << 3 | LENGTH_DELIMITED)
    if not field.shape:
        return varint(number << 3 | FIXED64)
    return varint(number << 3 | LENGTH_DELIMITED) + varint(field.count(dims) * DTYPE[field.kind].itemsize)


def _packer(field: Field) -> Callable[[Any], bytes]:
    if field.kind == "text":
        return _pack_text
    return np.ndarray.tobytes if field.shape else SCALAR[field.kind].pack


def _pack_text(value: str) -> bytes:
    data = value.encode()
    return varint(len(data)) + data


def _check(field: Field, value: Any, dims: Dims) -> None:
    if field.shape and np.shape(value) != field.extent(dims):
        raise ValueError(f"{field.name}: shape {np.shape(value)}, not {field.extent(dims)}")


def decode(name: str, data: bytes, dims: Dims) -> tuple[Any, ...]:
    """Return the values of one serialised message in table order: text as str, everything else as arrays.

    Raises ValueError when an array does not have the shape of the table, and the runtime's DecodeError for
    bytes that are not this message at all.
    """
    message = CLASSES[name].FromString(data)
    return tuple(_value(message, field, dims) for field in MESSAGES[name])


def _value(message: Message, field: Field, dims: Dims) -> Any:
    value = getattr(message, field.name)
    if field.kind == "text":
        return value
    if not field.shape:
        return np.array(value, DTYPE[field.kind])
    return np.fromiter(value, DTYPE[field.kind], len(value)).reshape(field.extent(dims))
