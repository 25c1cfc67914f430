"""What is on the wire, as a protobuf schema: the table below, its message classes, and its text as a .proto file.

`pbrg schema --datagrams` prints that text, so that a robot in any language can be given the same messages.
https://protobuf.dev/programming-guides/proto3/
"""

from __future__ import annotations

from typing import Any, NamedTuple

from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

VERSION = 3
NAME, PACKAGE = "pbrg/datagram.proto", "pbrg"
BODY = "body"  # the one of which every datagram has one
VECTOR = "foxglove.Vector2"


class Field(NamedTuple):
    """A field of a message; its number is its place in the table, from 1."""

    type: str  # as a .proto file has it; repeated ones are flat arrays in C order
    name: str
    meaning: str


HEADER = (
    Field("uint32", "version", f"{VERSION}; a datagram of another one is thrown away"),
    Field("uint32", "sender", "the robot; 0: the world"),
    Field("uint32", "tick", "from 0; of own, message, answer and gone"),
    Field("uint32", "round", "within the tick, from 0; of message"),
    Field("fixed64", "sent_ns", "when it was sent, by the sender's monotonic clock [ns]; 0: unknown"),
)
BODIES = (
    Field("bytes", "hello", "robot to world: SHA-256 of its scenario's YAML; world to robot, empty: wait for others"),
    Field("Start", "start", "world to robot: what it needs before the first tick"),
    Field("Empty", "ready", "robot to world: its program has started"),
    Field("OwnData", "own", "world to robot: what it measures at the tick"),
    Field("bytes", "message", "robot to robot: what its program sends in the round, perhaps nothing"),
    Field("Answer", "answer", "robot to world: what it applies at the tick"),
    Field("uint32", "gone", "world to robot: that robot is no more"),
    Field("Empty", "stop", "world to robot: the run is over, or of another scenario"),
    Field("string", "failed", "robot to world: why it ends, in one line"),
)
MESSAGES: dict[str, tuple[str, tuple[Field, ...]]] = {
    "Datagram": ("One UDP datagram. Robots are counted from 1.", (*HEADER, *BODIES)),
    "Start": (
        "What a robot gets before the first tick.",
        (
            Field("repeated Place", "places", "of the robot itself and of each neighbour"),
            Field("Doubles", "start", "every robot's first p (n x 2) [m], where governor.initial is start"),
            Field("OwnData", "own", "of the first tick"),
        ),
    ),
    "Place": (
        "Where a robot is, as the world sees it.",
        (
            Field("uint32", "robot", ""),
            Field("string", "host", "IPv4 address, such as 192.168.0.7"),
            Field("uint32", "port", "UDP"),
        ),
    ),
    "OwnData": (
        "What one robot measures at a tick.",
        (
            Field(VECTOR, "p", "shifted hand point [m]"),
            Field(VECTOR, "xi", "integral state [m]"),
            Field("double", "heading", "of its body [rad]"),
            Field("HalfSpaces", "half_spaces", "its own"),
            Field(VECTOR, "reference", "the operator's r [m], where the robot leads"),
            Field("Rows", "rows", "of its half-spaces, where they do not depend on the others' states"),
            Field("repeated double", "motion", "(1 + d x 2) behind motors and a delay [m], where that is predicted"),
        ),
    ),
    "HalfSpaces": (
        "Slots for half-spaces G q <= h of hand points q: H of them, in a team of n robots.",
        (
            Field("uint32", "robots", "n"),
            Field("repeated double", "G", "(H x 2) unit outward normals"),
            Field("repeated double", "h", "(H) [m]"),
            Field("repeated bool", "active", "(H) whether there is one in the slot"),
            Field("repeated bool", "binds", "(H x n) for which robots it holds"),
        ),
    ),
    "Rows": (
        "R rows a |x| + C m - d <= 0 of the robot's constraint.",
        (
            Field("repeated double", "a", "(R) weight of |x|"),
            Field("repeated double", "C", "(R x 2)"),
            Field("repeated double", "d", "(R) [m]"),
            Field("repeated bool", "active", "(R) whether there is one"),
            Field("Doubles", "along", "(R x 2) directions of the motion x, where it is not all motion"),
        ),
    ),
    "Answer": (
        "What one robot applies at a tick, and how it got there.",
        (
            Field(VECTOR, "m", "[m]"),
            Field("string", "status", "as in the log: ok, capped, holding, ..."),
            Field("Doubles", "multipliers", "(R) of its rows [m], where its program has them"),
            Field("uint32", "lost", "how many neighbours it counts as lost"),
            Field("Traffic", "traffic", "since its last answer"),
        ),
    ),
    "Traffic": (
        "What a robot's program sent and got.",
        (
            Field("uint64", "bytes_sent", ""),
            Field("uint32", "received", "messages, empty ones too"),
            Field("uint32", "missed", "that had not come when the robot went on"),
            Field("uint32", "timed", "of those that came, from the same machine, whose processes share a clock"),
            Field("uint64", "delay_sum_ns", "of these, from sending until the receiving process took it"),
            Field("uint64", "delay_max_ns", ""),
        ),
    ),
    "Doubles": ("An array that may be absent.", (Field("repeated double", "values", ""),)),
    "Empty": ("That it came says all.", ()),
}
SCALARS: dict[str, FieldDescriptorProto.Type.ValueType] = {
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "fixed64": FieldDescriptorProto.TYPE_FIXED64,
    "string": FieldDescriptorProto.TYPE_STRING,
    "uint32": FieldDescriptorProto.TYPE_UINT32,
    "uint64": FieldDescriptorProto.TYPE_UINT64,
}
WORDS = {number: word for word, number in SCALARS.items()}


def file_descriptor() -> FileDescriptorProto:
    """Return the schema as protobuf describes one."""
    file = FileDescriptorProto(name=NAME, package=PACKAGE, syntax="proto3", dependency=[Vector2.DESCRIPTOR.file.name])
    for name, (_, fields) in MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, field in enumerate(fields, start=1):
            _describe(message.field.add(name=field.name, number=number), field)
    datagram = file.message_type[0]
    datagram.oneof_decl.add(name=BODY)
    for field in datagram.field[len(HEADER) :]:
        field.oneof_index = 0
    return file


def proto_text(file: FileDescriptorProto) -> str:
    """Return a file of proto3 messages as text, those of the table with what they mean."""
    lines = [f'syntax = "{file.syntax}";', "", f"package {file.package};"]
    lines += ["", *(f'import "{name}";' for name in file.dependency)] if file.dependency else []
    for message in file.message_type:
        meaning, _ = MESSAGES.get(message.name, ("", ()))
        lines += ["", *([f"// {meaning}"] if meaning else []), *_message_lines(message)]
    return "\n".join(lines) + "\n"


def _describe(described: FieldDescriptorProto, field: Field) -> None:
    repeated, _, kind = field.type.rpartition(" ")
    described.label = FieldDescriptorProto.LABEL_REPEATED if repeated else FieldDescriptorProto.LABEL_OPTIONAL
    if kind in SCALARS:
        described.type = SCALARS[kind]
    else:
        described.type = FieldDescriptorProto.TYPE_MESSAGE
        described.type_name = f".{kind}" if "." in kind else f".{PACKAGE}.{kind}"


def _message_lines(message: DescriptorProto) -> list[str]:
    if not message.field:
        return [f"message {message.name} {{}}"]
    meanings = {field.name: field.meaning for field in MESSAGES.get(message.name, ("", ()))[1]}
    plain = [_field_line(field, meanings) for field in message.field if not field.HasField("oneof_index")]
    chosen = [_field_line(field, meanings) for field in message.field if field.HasField("oneof_index")]
    if chosen:
        chosen = [f"oneof {message.oneof_decl[0].name} {{", *(f"  {line}" for line in chosen), "}"]
    return [f"message {message.name} {{", *(f"  {line}" for line in (*plain, *chosen)), "}"]


def _field_line(field: FieldDescriptorProto, meanings: dict[str, str]) -> str:
    repeated = "repeated " if field.label == FieldDescriptorProto.LABEL_REPEATED else ""
    kind = WORDS.get(field.type) or field.type_name.removeprefix(f".{PACKAGE}.").removeprefix(".")
    meaning = meanings.get(field.name)
    return f"{repeated}{kind} {field.name} = {field.number};" + (f"  // {meaning}" if meaning else "")


def _message_classes() -> dict[str, Any]:
    pool = DescriptorPool()
    pool.AddSerializedFile(Vector2.DESCRIPTOR.file.serialized_pb)
    pool.Add(file_descriptor())
    return {name: GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{name}")) for name in MESSAGES}


CLASSES = _message_classes()
"""The protobuf class of each message in the table, e.g. `pbrg.Datagram` under "Datagram"."""
