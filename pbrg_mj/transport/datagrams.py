"""What is on the wire: one message of the protobuf schema a datagram. docs/hardware.md shows it.

Here the data of robots' programs become messages, and messages data. A robot is counted from 1 on the wire.
"""

from __future__ import annotations

from enum import StrEnum
from ipaddress import IPv4Address
from math import prod
from typing import Any, NamedTuple, get_args

import numpy as np
from google.protobuf.message import DecodeError

from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.rows import ALL_MOTION, Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.text import counted
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.schema import BODY, CLASSES, VERSION

WORLD = -1  # as a sender
LARGEST = 65507  # bytes of a UDP datagram over IPv4
MOST_BYTES = 2**63 - 1  # sent in a tick: what an array of integers has room for
PORTS = range(1, 1 << 16)
STATUSES: tuple[Status, ...] = get_args(Status)


class Kind(StrEnum):
    """What a datagram is: the name of its body in the schema."""

    HELLO = "hello"
    START = "start"
    READY = "ready"
    OWN = "own"
    MESSAGE = "message"
    ANSWER = "answer"
    GONE = "gone"
    STOP = "stop"
    FAILED = "failed"


class Datagram(NamedTuple):
    """One message."""

    kind: Kind
    robot: int  # sender, from 0; or WORLD
    tick: int = 0
    round: int = 0
    sent_ns: int = 0  # by the sender's monotonic clock, which processes of one machine share; 0: unknown
    body: Any = None  # as in the schema: bytes, text, a robot from 0, or a message; None: the empty one


class Traffic(NamedTuple):
    """What a robot's program sent and got in a tick."""

    bytes_sent: int = 0
    received: int = 0  # messages, empty ones too
    missed: int = 0  # that had not come when the robot went on
    timed: int = 0  # of those that came, from processes of the same machine, which share a clock
    delay_sum_ns: int = 0  # of these, from sending until the receiving process took it
    delay_max_ns: int = 0


class StartData(NamedTuple):
    """What a robot gets before the first tick."""

    places: dict[int, Address]  # of the robot itself and of its neighbours, as the world sees them
    start: np.ndarray | None  # (n, 2) every robot's first p [m]
    own: OwnData


def packed(one: Datagram) -> bytes:
    """Return the bytes of a datagram."""
    body = CLASSES["Empty"]() if one.body is None else one.body
    message = CLASSES["Datagram"](
        version=VERSION,
        sender=one.robot + 1,
        tick=one.tick,
        round=one.round,
        sent_ns=one.sent_ns,
        **{one.kind: body + 1 if one.kind is Kind.GONE else body},
    )
    return message.SerializeToString()


def unpacked(content: bytes) -> Datagram | None:
    """Return a datagram; None for what is none of ours."""
    try:
        message = CLASSES["Datagram"].FromString(content)
    except DecodeError:
        return None
    name = message.WhichOneof(BODY)
    if name is None or message.version != VERSION:
        return None
    kind, body = Kind(name), getattr(message, name)
    if kind is Kind.GONE:
        body -= 1
    return Datagram(kind, message.sender - 1, message.tick, message.round, message.sent_ns, body)


def own_message(own: OwnData) -> Any:
    """Return one robot's measurements as a message."""
    spaces, rows = own.half_spaces, own.rows
    return CLASSES["OwnData"](
        p=_vector(own.p),
        xi=_vector(own.xi),
        heading=own.heading,
        half_spaces={
            "robots": spaces.binds.shape[2],
            **{name: _flat(getattr(spaces, name)) for name in ("G", "h", "active", "binds")},
        },
        reference=None if own.reference is None else _vector(own.reference),
        rows=None if rows is None else _rows_message(rows),
        motion=None if own.motion is None else _flat(own.motion),
    )


def read_own(tick: int, message: Any) -> OwnData:
    """Return one robot's measurements. Raises ValueError for a message whose parts do not fit each other."""
    _require(message, "p", "xi", "half_spaces")
    spaces = message.half_spaces
    H, n = len(spaces.h), spaces.robots
    return OwnData(
        tick=tick,
        p=_pair(message.p),
        xi=_pair(message.xi),
        heading=message.heading,
        half_spaces=HalfSpaces(
            G=_doubles(spaces, "G", 1, H, 2),
            h=_doubles(spaces, "h", 1, H),
            active=_flags(spaces, "active", 1, H),
            binds=_flags(spaces, "binds", 1, H, n),
        ),
        reference=_pair(message.reference) if message.HasField("reference") else None,
        rows=_read_rows(message.rows) if message.HasField("rows") else None,
        motion=_doubles(message, "motion", len(message.motion) // 2, 2) if message.motion else None,
    )


def start_message(data: StartData) -> Any:
    """Return what a robot gets before the first tick, as a message."""
    return CLASSES["Start"](
        places=[{"robot": robot + 1, **one._asdict()} for robot, one in sorted(data.places.items())],
        start=_optional(data.start),
        own=own_message(data.own),
    )


def read_start(message: Any) -> StartData:
    """Return it. Raises ValueError for a message whose parts do not fit each other, and for no addresses."""
    _require(message, "own")
    places = {}
    for place in message.places:
        if not place.robot or place.port not in PORTS:
            raise ValueError(f"robot {place.robot} at port {place.port}")
        places[place.robot - 1] = Address(str(IPv4Address(place.host)), place.port)
    start = None
    if message.HasField("start"):
        start = _doubles(message.start, "values", len(message.start.values) // 2, 2)
    return StartData(places, start, read_own(0, message.own))


def answer_message(answer: RobotAnswer, traffic: Traffic) -> Any:
    """Return what a robot applies, and what it sent and got, as a message."""
    return CLASSES["Answer"](
        m=_vector(answer.m),
        status=answer.status,
        multipliers=_optional(answer.multipliers),
        lost=answer.lost,
        traffic=traffic._asdict(),
    )


def read_answer(message: Any) -> tuple[RobotAnswer, Traffic]:
    """Return them. Raises ValueError for a message that is no answer."""
    _require(message, "m")
    if message.status not in STATUSES:
        raise ValueError(f"status {message.status[:40]!r}")
    traffic = Traffic(*(getattr(message.traffic, name) for name in Traffic._fields))
    if traffic.bytes_sent > MOST_BYTES:
        raise ValueError(f"{traffic.bytes_sent} bytes sent")
    multipliers = None
    if message.HasField("multipliers"):
        multipliers = _doubles(message.multipliers, "values", len(message.multipliers.values))
    return RobotAnswer(_pair(message.m), message.status, multipliers, message.lost), traffic


def _rows_message(rows: Rows) -> dict[str, Any]:
    arrays = {name: _flat(getattr(rows, name)) for name in ("a", "C", "d", "active")}
    return {**arrays, "along": _optional(rows.along if len(rows.along) else None)}


def _read_rows(rows: Any) -> Rows:
    R = len(rows.d)
    a, C, d = _doubles(rows, "a", 1, R), _doubles(rows, "C", 1, R, 2), _doubles(rows, "d", 1, R)
    along = _doubles(rows.along, "values", 1, R, 2) if rows.HasField("along") else ALL_MOTION
    return Rows(a, C, d, _flags(rows, "active", 1, R), along)


def _vector(pair: np.ndarray) -> dict[str, float]:
    x, y = pair
    return {"x": float(x), "y": float(y)}


def _pair(vector: Any) -> np.ndarray:
    return np.array([vector.x, vector.y])


def _flat(array: np.ndarray) -> list[Any]:
    return array.ravel().tolist()


def _optional(array: np.ndarray | None) -> dict[str, list[Any]] | None:
    return None if array is None else {"values": _flat(array)}


def _doubles(message: Any, name: str, *shape: int) -> np.ndarray:
    return _array(message, name, shape, float)


def _flags(message: Any, name: str, *shape: int) -> np.ndarray:
    return _array(message, name, shape, bool)


def _array(message: Any, name: str, shape: tuple[int, ...], kind: type) -> np.ndarray:
    values = getattr(message, name)
    if len(values) != prod(shape):
        raise ValueError(f"{message.DESCRIPTOR.name}.{name} has {counted(len(values), 'value')}, not {prod(shape)}")
    return np.array(values[:], dtype=kind).reshape(shape)


def _require(message: Any, *names: str) -> None:
    if absent := [name for name in names if not message.HasField(name)]:
        raise ValueError(f"{message.DESCRIPTOR.name} without {', '.join(absent)}")
