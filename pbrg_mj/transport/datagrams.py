"""What is on the wire: one datagram a message, little-endian, fixed layouts. docs/hardware.md lists them.

Every datagram has a header; what follows it depends on its kind. What does not fit its layout is no datagram of ours.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from socket import inet_aton, inet_ntoa
from typing import Any, NamedTuple, get_args

import numpy as np

from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.rows import ALL_MOTION, Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.transport.address import Address

HEADER = struct.Struct("<4sBBHIIQ")  # magic, version, kind, sender, tick, round, when it was sent
MAGIC, VERSION = b"PBRG", 2
WORLD = 0xFFFF  # as a sender
LARGEST = 65507  # bytes of a UDP datagram over IPv4
COUNTS = struct.Struct("<HHHB")  # half-spaces, robots, rows, and which of REFERENCE, ROWS, ALONG follow
REFERENCE, ROWS, ALONG = 1, 2, 4
ANSWER = struct.Struct("<2dBHH")  # m, status, neighbours lost, multipliers
NO_MULTIPLIERS = 0xFFFF
TRAFFIC = struct.Struct("<QIIIQQ")
PLACE = struct.Struct("<H4sH")  # a robot, its IPv4 address and its port
STATUSES: tuple[Status, ...] = get_args(Status)


class Kind(IntEnum):
    """What a datagram is."""

    HELLO = 1  # robot to world: the SHA-256 of its scenario
    START = 2  # world to robot: where neighbours are, every robot's first p where it is known, its first measurements
    READY = 3  # robot to world
    OWN = 4  # world to robot: a tick's measurements
    MESSAGE = 5  # robot to robot: what its program sends in a round, perhaps nothing
    ANSWER = 6  # robot to world: what it applies in a tick
    GONE = 7  # world to robots: the robot named as the round is no more
    STOP = 8  # world to robot
    FAILED = 9  # robot to world: why, in one line


class Datagram(NamedTuple):
    """One message."""

    kind: Kind
    robot: int  # sender, from 0; or WORLD
    tick: int = 0
    round: int = 0
    sent_ns: int = 0  # by the sender's monotonic clock, which processes of one machine share
    body: bytes = b""


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
    return HEADER.pack(MAGIC, VERSION, one.kind, one.robot, one.tick, one.round, one.sent_ns) + one.body


def unpacked(content: bytes) -> Datagram | None:
    """Return a datagram; None for what is none of ours."""
    if len(content) < HEADER.size:
        return None
    magic, version, kind, *rest = HEADER.unpack_from(content)
    if (magic, version) != (MAGIC, VERSION) or kind not in list(Kind):
        return None
    robot, tick, number, sent = rest
    return Datagram(Kind(kind), robot, tick, number, sent, content[HEADER.size :])


def packed_own(own: OwnData) -> bytes:
    """Return the bytes of one robot's measurements."""
    spaces, rows = own.half_spaces, own.rows
    along = rows is not None and len(rows.along) > 0
    parts = REFERENCE * (own.reference is not None) | ROWS * (rows is not None) | ALONG * along
    counts = spaces.h.shape[1], spaces.binds.shape[2], 0 if rows is None else rows.d.shape[1], parts
    arrays = [own.p, own.xi, np.array([own.heading]), spaces.G, spaces.h, spaces.active, spaces.binds]
    arrays += [] if own.reference is None else [own.reference]
    arrays += [] if rows is None else [rows.a, rows.C, rows.d, rows.active]
    arrays += [rows.along] if rows is not None and along else []
    return COUNTS.pack(*counts) + b"".join(map(_bytes, arrays))


def unpacked_own(tick: int, content: bytes) -> OwnData:
    """Return one robot's measurements. Raises ValueError for other bytes."""
    reader = _Reader(content)
    H, n, R, parts = reader.struct(COUNTS)
    p, xi, heading = reader.doubles(2), reader.doubles(2), float(reader.doubles(1)[0])
    G, h = reader.doubles(1, H, 2), reader.doubles(1, H)
    spaces = HalfSpaces(G, h, reader.flags(1, H), reader.flags(1, H, n))
    reference = reader.doubles(2) if parts & REFERENCE else None
    rows = None
    if parts & ROWS:
        a, C, d, active = reader.doubles(1, R), reader.doubles(1, R, 2), reader.doubles(1, R), reader.flags(1, R)
        rows = Rows(a, C, d, active, reader.doubles(1, R, 2) if parts & ALONG else ALL_MOTION)
    reader.end()
    return OwnData(tick, p, xi, heading, spaces, reference, rows)


def packed_start(data: StartData) -> bytes:
    """Return the bytes of what a robot gets before the first tick."""
    start = b"" if data.start is None else _bytes(data.start)
    counts = struct.pack("<HH", len(data.places), 0 if data.start is None else len(data.start))
    places = (PLACE.pack(robot, inet_aton(one.host), one.port) for robot, one in sorted(data.places.items()))
    return counts + b"".join(places) + start + packed_own(data.own)


def unpacked_start(content: bytes) -> StartData:
    """Return it. Raises ValueError for other bytes."""
    reader = _Reader(content)
    count, n = reader.struct(struct.Struct("<HH"))
    listed = [reader.struct(PLACE) for _ in range(count)]
    places = {robot: Address(inet_ntoa(host), port) for robot, host, port in listed}
    start = reader.doubles(n, 2) if n else None
    return StartData(places, start, unpacked_own(0, reader.rest()))


def packed_answer(answer: RobotAnswer, traffic: Traffic) -> bytes:
    """Return the bytes of what a robot applies, and of what it sent and got."""
    multipliers = answer.multipliers
    count = NO_MULTIPLIERS if multipliers is None else len(multipliers)
    head = ANSWER.pack(*answer.m, STATUSES.index(answer.status), answer.lost, count)
    return head + TRAFFIC.pack(*traffic) + (b"" if multipliers is None else _bytes(multipliers))


def unpacked_answer(content: bytes) -> tuple[RobotAnswer, Traffic]:
    """Return them. Raises ValueError for other bytes."""
    reader = _Reader(content)
    x, y, status, lost, count = reader.struct(ANSWER)
    traffic = Traffic(*reader.struct(TRAFFIC))
    multipliers = None if count == NO_MULTIPLIERS else reader.doubles(count)
    reader.end()
    if status >= len(STATUSES):
        raise ValueError(f"status {status}")
    return RobotAnswer(np.array([x, y]), STATUSES[status], multipliers, lost), traffic


class _Reader:
    """Reads bytes from front to back. Raises ValueError where there are too few or too many."""

    def __init__(self, content: bytes):
        self._content, self._at = content, 0

    def struct(self, layout: struct.Struct) -> tuple[Any, ...]:
        return layout.unpack(self._take(layout.size))

    def doubles(self, *shape: int) -> np.ndarray:
        return np.frombuffer(self._take(8 * int(np.prod(shape))), dtype="<f8").reshape(shape).copy()

    def flags(self, *shape: int) -> np.ndarray:
        return np.frombuffer(self._take(int(np.prod(shape))), dtype=np.uint8).reshape(shape) != 0

    def rest(self) -> bytes:
        return self._content[self._at :]

    def end(self) -> None:
        if self.rest():
            raise ValueError(f"{len(self.rest())} bytes too many")

    def _take(self, size: int) -> bytes:
        taken = self._content[self._at : self._at + size]
        if len(taken) < size:
            raise ValueError(f"{size - len(taken)} bytes too few")
        self._at += size
        return taken


def _bytes(array: np.ndarray) -> bytes:
    kind = np.uint8 if array.dtype == bool else "<f8"
    return np.ascontiguousarray(array, dtype=kind).tobytes()
