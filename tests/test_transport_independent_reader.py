"""Readers of others, protobufjs and @mcap/core on node, decode datagrams of every kind, and encode them."""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from google.protobuf.descriptor_pb2 import FileDescriptorProto

import pbrg_mj as pbrg
from pbrg_mj.api.datagrams import datagram_schema, write_datagram_schema
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import OwnData
from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.transport import datagrams as wire
from pbrg_mj.transport import mailbox
from pbrg_mj.transport.schema import proto_text
from tests.node_packages import installed_scripts, printed
from tests.robots_apart import DIGEST, Killed, apart, loaded, solutions

PAGE = (Path(__file__).parents[1] / "docs" / "hardware.md").read_text(encoding="utf-8")


def ending(program: Any) -> Any:
    """Return a program that is killed on robot 3 at tick 2, and fails on robot 1 at tick 4."""

    class Ending(type(program)):
        def begin(self, own: OwnData, memory: Any) -> Any:
            if (own.tick, memory.facts.robot) == (2, 2):
                raise Killed
            if (own.tick, memory.facts.robot) == (4, 0):
                raise ValueError("too far: 3 µm")
            return super().begin(own, memory)

    return Ending(**vars(program))


@pytest.fixture(scope="module")
def captured() -> list[bytes]:
    """Every datagram of a run in which one robot is killed and another one fails."""
    scenario = loaded(**{"governor.initial": "start"})
    whole = robot_programs(scenario)
    governor = NetworkedGovernor(**{**vars(whole), "program": ending(whole.program)})
    found: list[bytes] = []

    def keep(one: wire.Datagram) -> bytes:
        found.append(wire.packed(one))
        return found[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mailbox, "packed", keep)
        with apart(scenario, governor=governor) as team, pytest.raises(pbrg.PbrgError, match="too far"):
            solutions(scenario, team)
    return found


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return installed_scripts(tmp_path_factory.mktemp("node"))


@pytest.fixture(scope="module")
def decoded(captured: list[bytes], scripts: Path) -> list[dict[str, Any]]:
    """Each datagram as decoded by the text that `pbrg schema --datagrams` prints."""
    for name in ("pbrg", "foxglove"):
        (scripts / name).mkdir()
    write_datagram_schema(scripts / "pbrg" / "datagram.proto")
    vector = FileDescriptorProto()
    Vector2.DESCRIPTOR.file.CopyToProto(vector)
    (scripts / vector.name).write_text(proto_text(vector), encoding="utf-8")
    file = scripts / "datagrams.json"
    file.write_text(json.dumps([b64encode(one).decode() for one in captured]), encoding="utf-8")
    return printed(scripts / "decode_datagrams.cjs", scripts, file)


def test_every_kind_is_decoded_and_encoded_again(captured: list[bytes], decoded: list[dict[str, Any]]) -> None:
    assert {one["decoded"]["body"] for one in decoded} == set(wire.Kind)
    for content, other in zip(captured, decoded, strict=True):
        one, found = wire.unpacked(content), other["decoded"]
        assert one is not None
        assert (found["body"], found["version"], int(found["sent_ns"])) == (one.kind, 3, one.sent_ns)
        assert (found.get("sender", 0) - 1, found.get("tick", 0), found.get("round", 0)) == one[1:4]
        assert wire.unpacked(b64decode(other["encoded"])) == one


def test_measurements_are_those_that_python_reads(captured: list[bytes], decoded: list[dict[str, Any]]) -> None:
    led = 0
    for one, found in of_kind(wire.Kind.OWN, captured, decoded):
        holds(found, wire.read_own(one.tick, one.body))
        led += "reference" in found
    assert led == 5  # one leader, ticks 0 to 4
    for one, found in of_kind(wire.Kind.START, captured, decoded):
        start = wire.read_start(one.body)
        assert start.start is not None
        holds(found["own"], start.own)
        assert found["start"]["values"] == start.start.ravel().tolist()
        places = {place["robot"] - 1: (place["host"], place["port"]) for place in found["places"]}
        assert places == start.places and len(places) == 3


def holds(found: dict[str, Any], own: OwnData) -> None:
    """Hold measurements of the other reader to those of Python."""
    spaces, rows = own.half_spaces, own.rows
    assert (vector(found["p"]), vector(found["xi"])) == (own.p.tolist(), own.xi.tolist())
    assert found.get("heading", 0.0) == own.heading
    for name in ("G", "h", "active", "binds"):
        assert found["half_spaces"][name] == getattr(spaces, name).ravel().tolist(), name
    assert rows is not None
    for name in ("a", "C", "d", "active"):
        assert found["rows"][name] == getattr(rows, name).ravel().tolist(), name
    assert ("reference" in found) == (own.reference is not None)
    if own.reference is not None:
        assert vector(found["reference"]) == own.reference.tolist()


def test_what_robots_say_is_what_python_reads(captured: list[bytes], decoded: list[dict[str, Any]]) -> None:
    for one, found in of_kind(wire.Kind.ANSWER, captured, decoded):
        answer, traffic = wire.read_answer(one.body)
        assert answer.multipliers is not None
        assert (vector(found["m"]), found["status"]) == (answer.m.tolist(), answer.status)
        assert found["multipliers"]["values"] == answer.multipliers.tolist()
        assert [int(found["traffic"].get(name, 0)) for name in traffic._fields] == list(traffic)
    for one, found in of_kind(wire.Kind.MESSAGE, captured, decoded):
        assert b64decode(found) == one.body
    assert {found for _, found in of_kind(wire.Kind.GONE, captured, decoded)} == {3}
    assert {found for _, found in of_kind(wire.Kind.FAILED, captured, decoded)} == {"too far: 3 µm"}
    greetings = {
        (one.robot == wire.WORLD, b64decode(found)) for one, found in of_kind(wire.Kind.HELLO, captured, decoded)
    }
    assert greetings == {(True, b""), (False, DIGEST)}


def of_kind(
    kind: wire.Kind, captured: list[bytes], decoded: list[dict[str, Any]]
) -> Iterator[tuple[wire.Datagram, Any]]:
    """Yield the datagrams of a kind as Python reads them, each with the body that the other reader found."""
    for content, other in zip(captured, decoded, strict=True):
        one = wire.unpacked(content)
        if one is not None and one.kind is kind:
            yield one, other["decoded"][kind]


def vector(found: dict[str, float]) -> list[float]:
    """Return x and y, of which zeros are not sent."""
    return [found.get("x", 0.0), found.get("y", 0.0)]


def test_datagrams_in_an_mcap_file_are_decoded_by_the_schema_in_it(
    captured: list[bytes], scripts: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page's lines write it."""
    monkeypatch.chdir(tmp_path)
    (lines,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(lines, {"captured": [(1000 + k, one) for k, one in enumerate(captured)]})
    (channel,) = printed(scripts / "read_log.cjs", tmp_path / "datagrams.mcap").values()
    assert (channel["schema"], channel["count"]) == ("pbrg.Datagram", len(captured))
    assert channel["first"]["hello"] == b64encode(DIGEST).decode()


def test_the_page_shows_the_text() -> None:
    (shown,) = re.findall(r"```proto\n(.*?)```", PAGE, re.DOTALL)
    assert shown == datagram_schema()
