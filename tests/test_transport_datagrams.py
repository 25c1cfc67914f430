"""What is on the wire: data come out as they were, and what is none of ours is thrown away or refused."""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer
from pbrg_mj.governor.problem.rows import ALL_MOTION, Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.transport import datagrams as wire
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.schema import CLASSES, MESSAGES, file_descriptor, proto_text

STRANGE = [-0.0, math.inf, -math.inf, math.nan, 5e-324, 0.1]
READERS = {
    wire.Kind.START: wire.read_start,
    wire.Kind.OWN: lambda message: wire.read_own(7, message),
    wire.Kind.ANSWER: wire.read_answer,
}


def random_own(random: np.random.Generator, H: int, n: int, R: int, *, along: bool, leads: bool) -> OwnData:
    flags = _flags(random, 1, H), _flags(random, 1, H, n)
    spaces = HalfSpaces(_numbers(random, 1, H, 2), _numbers(random, 1, H), *flags)
    rows = Rows(
        _numbers(random, 1, R),
        _numbers(random, 1, R, 2),
        _numbers(random, 1, R),
        _flags(random, 1, R),
        _numbers(random, 1, R, 2) if along else ALL_MOTION,
    )
    reference = _numbers(random, 2) if leads else None
    heading = float(_numbers(random, 1)[0])
    return OwnData(7, _numbers(random, 2), _numbers(random, 2), heading, spaces, reference, None if R == 1 else rows)


def _numbers(random: np.random.Generator, *shape: int) -> np.ndarray:
    """Return random numbers, among them those that are easily changed on the way."""
    return np.where(random.random(shape) < 0.3, random.choice(STRANGE, shape), random.normal(size=shape))


def _flags(random: np.random.Generator, *shape: int) -> np.ndarray:
    return random.integers(0, 2, shape).astype(bool)


def sent(kind: wire.Kind, body: Any) -> Any:
    """Return a body as it comes out of a datagram."""
    came = wire.unpacked(wire.packed(wire.Datagram(kind, 1, body=body)))
    assert came is not None and came.kind is kind
    return came.body


@pytest.mark.parametrize("seed", range(12))
def test_what_is_packed_comes_out_as_it_was(seed: int) -> None:
    random = np.random.default_rng(seed)
    own = random_own(random, seed, 5, seed % 4, along=bool(seed % 3), leads=seed > 2)
    same(wire.read_own(7, sent(wire.Kind.OWN, wire.own_message(own))), own)
    start = wire.StartData(
        {1: Address("127.0.0.1", 4000), 3: Address("192.168.0.7", 65535)},
        _numbers(random, 5, 2) if seed % 2 else None,
        own._replace(tick=0),
    )
    same(wire.read_start(sent(wire.Kind.START, wire.start_message(start))), start)
    answer = RobotAnswer(_numbers(random, 2), "holding", _numbers(random, seed // 2) if seed % 2 else None, seed)
    traffic = wire.Traffic(1 << 40, 2, 3, 1, 4, 1 << 50)
    same(wire.read_answer(sent(wire.Kind.ANSWER, wire.answer_message(answer, traffic))), (answer, traffic))


def same(ours: Any, theirs: Any) -> None:
    """Hold one to the other bit for bit."""
    if isinstance(theirs, np.ndarray):
        assert (ours.dtype, ours.shape, ours.tobytes()) == (theirs.dtype, theirs.shape, theirs.tobytes())
    elif isinstance(theirs, tuple):
        assert type(ours) is type(theirs)
        for one, other in zip(ours, theirs, strict=True):
            same(one, other)
    elif hasattr(theirs, "__dict__"):
        same(tuple(vars(ours).values()), tuple(vars(theirs).values()))
    elif isinstance(theirs, float):
        assert struct.pack("<d", ours) == struct.pack("<d", theirs)
    else:
        assert ours == theirs


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (wire.Kind.HELLO, b"\0\xff" * 16),
        (wire.Kind.HELLO, b""),
        (wire.Kind.READY, None),
        (wire.Kind.MESSAGE, bytes(range(256))),
        (wire.Kind.MESSAGE, b""),
        (wire.Kind.GONE, 0),
        (wire.Kind.STOP, None),
        (wire.Kind.FAILED, "it is too far: 3 µm"),
    ],
)
@pytest.mark.parametrize("robot", [wire.WORLD, 0, 3])
def test_every_datagram_comes_out_as_it_was(kind: wire.Kind, body: Any, robot: int) -> None:
    one = wire.Datagram(kind, robot, 1 << 31, 9, 1 << 60, body)
    expected = one if body is not None else one._replace(body=CLASSES["Empty"]())
    assert wire.unpacked(wire.packed(one)) == expected


def test_what_is_none_of_ours_is_thrown_away() -> None:
    ready = CLASSES["Datagram"](version=3, sender=2, ready={})
    strange = {
        "nothing": b"",
        "an earlier layout": struct.pack("<4sBBHIIQ", b"PBRG", 2, 3, 0, 0, 0, 0),
        "cut": wire.packed(wire.Datagram(wire.Kind.MESSAGE, 1, body=b"12345678"))[:-1],
        "no body": CLASSES["Datagram"](version=3, sender=2).SerializeToString(),
        "no version": CLASSES["Datagram"](sender=2, ready={}).SerializeToString(),
        "another version": CLASSES["Datagram"](version=4, sender=2, ready={}).SerializeToString(),
        "text that is none": b"\x08\x03\x72\x01\xff",
    }
    assert wire.unpacked(ready.SerializeToString()) is not None
    assert {name: wire.unpacked(one) for name, one in strange.items()} == dict.fromkeys(strange)


def wrong_own(**changes: Any) -> Any:
    message = wire.own_message(random_own(np.random.default_rng(1), 3, 5, 4, along=True, leads=True))
    for path, value in changes.items():
        *parts, name = path.split("__")
        part = message
        for one in parts:
            part = getattr(part, one)
        if value is None:
            part.ClearField(name)
        elif isinstance(value, list):
            part.ClearField(name)
            getattr(part, name).extend(value)
        else:
            setattr(part, name, value)
    return message


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"p": None}, "OwnData without p"),
        ({"xi": None, "half_spaces": None}, "OwnData without xi, half_spaces"),
        ({"half_spaces__G": [1.0]}, "HalfSpaces.G has 1 value, not 6"),
        ({"half_spaces__h": [1.0] * 4}, "HalfSpaces.G has 6 values, not 8"),
        ({"half_spaces__active": []}, "HalfSpaces.active has 0 values, not 3"),
        ({"half_spaces__robots": 4_294_967_295}, "HalfSpaces.binds has 15 values, not 12884901885"),
        ({"half_spaces__binds": [True] * 16}, "HalfSpaces.binds has 16 values, not 15"),
        ({"rows__a": []}, "Rows.a has 0 values, not 4"),
        ({"rows__C": [0.0] * 4}, "Rows.C has 4 values, not 8"),
        ({"rows__active": [True]}, "Rows.active has 1 value, not 4"),
        ({"rows__along__values": []}, "Doubles.values has 0 values, not 8"),
    ],
)
def test_measurements_that_do_not_fit_each_other_are_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        wire.read_own(0, wrong_own(**changes))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"own": None}, "Start without own"),
        ({"places": [{"robot": 0, "host": "127.0.0.1", "port": 9}]}, "robot 0 at port 9"),
        ({"places": [{"robot": 1, "host": "127.0.0.1", "port": 65536}]}, "robot 1 at port 65536"),
        ({"places": [{"robot": 1, "host": "example.org", "port": 9}]}, "'example.org'"),
        ({"places": [{"robot": 1, "host": "", "port": 9}]}, "Address cannot be empty"),
        ({"start": {"values": [0.0, 1.0, 2.0]}}, "Doubles.values has 3 values, not 2"),
    ],
)
def test_a_start_that_does_not_fit_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        wire.read_start(CLASSES["Start"](**{"own": wrong_own(), **changes}))


def read(content: bytes) -> None:
    """Read all of a datagram, as its receiver does; ValueError is what it handles."""
    one = wire.unpacked(content)
    if one is not None and one.kind in READERS:
        try:
            READERS[one.kind](one.body)
        except ValueError as error:
            assert "\n" not in str(error) and len(str(error)) < 200


@settings(max_examples=4000, deadline=None)
@given(st.binary(max_size=200))
def test_random_bytes_raise_nothing_else(content: bytes) -> None:
    read(content)
    read(b"\x08\x03" + content)


@settings(max_examples=4000, deadline=None)
@given(st.sampled_from(list(wire.Kind)), st.data())
def test_random_changes_of_datagrams_raise_nothing_else(kind: wire.Kind, data: st.DataObject) -> None:
    content = bytearray(SAMPLES[kind])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content)))
        content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    read(bytes(content))


def _samples() -> dict[wire.Kind, bytes]:
    own = random_own(np.random.default_rng(1), 3, 5, 4, along=True, leads=True)
    start = wire.StartData({0: Address("127.0.0.1", 4000)}, np.ones((5, 2)), own)
    answer = wire.answer_message(RobotAnswer(np.ones(2), "ok", np.ones(3)), wire.Traffic(1, 2, 3, 4, 5, 6))
    bodies = {
        wire.Kind.HELLO: bytes(32),
        wire.Kind.START: wire.start_message(start),
        wire.Kind.OWN: wire.own_message(own),
        wire.Kind.MESSAGE: b"123",
        wire.Kind.ANSWER: answer,
        wire.Kind.GONE: 3,
        wire.Kind.FAILED: "why",
    }
    return {kind: wire.packed(wire.Datagram(kind, 1, 5, 6, 7, bodies.get(kind))) for kind in wire.Kind}


SAMPLES = _samples()


def test_every_kind_is_a_body_of_the_schema() -> None:
    (body,) = CLASSES["Datagram"].DESCRIPTOR.oneofs
    assert [field.name for field in body.fields] == list(wire.Kind)
    assert all(field.number < 16 for field in body.fields)  # a tag of one byte


def test_the_text_has_every_field_with_its_meaning() -> None:
    lines = proto_text(file_descriptor()).splitlines()
    assert max(map(len, lines)) <= 120
    for name, (meaning, fields) in MESSAGES.items():
        assert f"// {meaning}" in lines
        for number, field in enumerate(fields, start=1):
            comment = f"  // {field.meaning}" if field.meaning else ""
            assert sum(line.lstrip() == f"{field.type} {field.name} = {number};{comment}" for line in lines) >= 1, name
