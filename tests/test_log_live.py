"""The live view serves the log's own bytes, and leaves the run alone."""

from __future__ import annotations

import json
import socket as sockets
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mcap.reader import make_reader

from pbrg_mj.cli.main import main
from pbrg_mj.cli.real_time import pacer
from pbrg_mj.log.live import LiveServer
from pbrg_mj.log.write.writer import LogWriter
from tests.needs import need_module
from tests.records import loaded, records

MESSAGE = struct.Struct("<BIQ")  # opcode 1, subscription, log time
TICKS = 30


def receive(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next JSON message of a kind."""
    while True:
        data = socket.recv()
        if isinstance(data, str) and (message := json.loads(data))["op"] == kind:
            return message


def subscribe(socket: Any) -> tuple[dict[int, str], dict[str, dict[str, Any]]]:
    """Subscribe to every channel; return subscription -> topic, and topic -> what is advertised."""
    offers = receive(socket, "advertise")["channels"]
    wanted = [{"id": one["id"], "channelId": one["id"]} for one in offers]
    socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    return {one["id"]: one["topic"] for one in offers}, {one["topic"]: one for one in offers}


def collect(socket: Any, topics: dict[int, str], count: int) -> list[tuple[str, int, bytes]]:
    found = []
    while len(found) < count:
        data = socket.recv()
        if isinstance(data, bytes) and data[0] == 1:
            _, subscription, time_ns = MESSAGE.unpack_from(data)
            found.append((topics[subscription], time_ns, data[MESSAGE.size :]))
    return found


def test_a_plain_client_gets_the_same_bytes_as_the_log(tmp_path: Path) -> None:
    client = need_module("websockets.sync.client")
    path, plan = tmp_path / "log.mcap", loaded(timings=True)
    first, *rest = records(TICKS)
    with LiveServer(plan.scenario, 0) as serve:
        assert serve.address.startswith("ws://127.0.0.1:")
        with LogWriter(path, plan, "") as write:
            for record in (first, *rest):
                write(record)
        logged = messages(path)
        serve(first)
        with client.connect(serve.address, subprotocols=["foxglove.sdk.v1"], max_size=None, proxy=None) as socket:
            topics, offers = subscribe(socket)
            scene = [message for message in logged if message[0] == "/scene"]  # again, for the newcomer
            assert collect(socket, topics, 1) == scene  # so the server knows of all subscriptions
            for record in rest:
                serve(record)
            expected = [message for message in logged if message[1] > 0]
            assert collect(socket, topics, len(expected)) == expected
    assert set(offers) == {topic for topic, _, _ in logged}
    assert offers["/scan/robot_3"]["schemaName"] == "foxglove.LaserScan"
    assert {one["encoding"] for one in offers.values()} == {"protobuf"}


def test_a_viewer_that_leaves_disturbs_nobody(capfd: pytest.CaptureFixture[str]) -> None:
    client = need_module("websockets.sync.client")
    first, *rest = records(8)
    with LiveServer(loaded(timings=True).scenario, 0) as serve:
        serve(first)
        how = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None, "proxy": None}
        stays, leaves = (client.connect(serve.address, **how) for _ in range(2))
        with stays:
            with leaves:
                for socket in (stays, leaves):
                    topics, _ = subscribe(socket)
                    collect(socket, topics, 1)
                serve(rest[0])
                leaves.send("not JSON")
                leaves.send('{"op": "unsubscribe", "subscriptionIds": 7}')
                leaves.send('{"op": "subscribe", "subscriptions": [{"id": "x"}]}')
            for record in rest[1:]:
                serve(record)
            times = []
            while not times or times[-1] < round(rest[-1].time * 1e9):
                times.append(collect(stays, topics, 1)[0][1])
    assert times == sorted(times)
    assert capfd.readouterr() == ("", "")


def handshake(address: str, *headers: str) -> str:
    """The first line that the server answers a browser's handshake with."""
    host, port = address.removeprefix("ws://").split(":")
    lines = [
        *("GET / HTTP/1.1", f"Host: {host}:{port}", "Upgrade: websocket", "Connection: Upgrade"),
        *("Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13"),
        *("Sec-WebSocket-Protocol: foxglove.sdk.v1", *headers),
    ]
    with sockets.create_connection((host, int(port))) as socket:
        socket.sendall("\r\n".join([*lines, "", ""]).encode())
        return socket.makefile("rb").readline().decode("ascii").strip()


FOREIGN = (
    "https://example.org",
    "http://127.0.0.1.example.org",
    "http://localhost.example.org:8080",
    "https://app.foxglove.dev.example.org",
    "http://app.foxglove.dev",
    "null",
    "",
)
OWN = ("https://app.foxglove.dev", "http://localhost:8080", "http://127.0.0.1", "http://[::1]:5000", "file://")


def test_pages_from_elsewhere_are_refused(capfd: pytest.CaptureFixture[str]) -> None:
    with LiveServer(loaded(timings=True).scenario, 0) as serve:
        for origin in FOREIGN:
            assert handshake(serve.address, f"Origin: {origin}") == "HTTP/1.1 403 Forbidden", origin
        for origin in OWN:
            assert handshake(serve.address, f"Origin: {origin}") == "HTTP/1.1 101 Switching Protocols", origin
        assert handshake(serve.address) == "HTTP/1.1 101 Switching Protocols"  # no browser
        assert handshake(serve.address, "Origin: file://", "Origin: https://example.org").startswith("HTTP/1.1 4")
    assert capfd.readouterr() == ("", "")


def messages(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as file:
        found = make_reader(file).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in found]


def test_a_run_makes_the_same_log_with_and_without(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["run", "paper/simulation_near", "--duration", "0.5", "--set", "log.timings=false", "--quiet"]
    assert main([*arguments, "-o", str(tmp_path / "plain.mcap")]) == 0
    assert main([*arguments, "-o", str(tmp_path / "live.mcap"), "--live", "--port", "0", "--pace", "5"]) == 0
    assert capsys.readouterr().err.startswith("live at ws://127.0.0.1:")
    assert (tmp_path / "plain.mcap").read_bytes() == (tmp_path / "live.mcap").read_bytes()


def test_a_port_that_is_taken_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with LiveServer(loaded(timings=True).scenario, 0) as serve:
        port = serve.address.rsplit(":", 1)[1]
        assert main(["run", "paper/simulation_near", "-o", str(tmp_path / "a.mcap"), "--live", "--port", port]) == 2
    assert f"cannot listen on 127.0.0.1:{port}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--live", "--port", "65536"], "--port is 65536; allowed: 0 to 65535"),
        (["--pace", "0"], "--pace is 0"),
        (["--pace", "inf"], "--pace"),
    ],
)
def test_what_is_wrong_is_one_line(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "paper/simulation_near", "-o", str(tmp_path / "log.mcap"), *options]) == 2
    errors = capsys.readouterr().err
    assert said in errors and errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_pace_holds_records_back_until_they_are_due(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock on which a tick takes 3 ms of computing, one of them 100 ms."""
    now = [5.0]

    def sleep(duration: float) -> None:
        assert duration >= 0
        now[0] += duration

    monkeypatch.setattr("pbrg_mj.cli.real_time.time", SimpleNamespace(perf_counter=lambda: now[0], sleep=sleep))
    wait, due = pacer(0.5), []
    for record in records(6):  # 20 ms each
        wait(record)
        due.append(now[0] - 5.0)
        now[0] += 0.1 if record.index == 2 else 0.003
    assert due == pytest.approx([0.0, 0.04, 0.08, 0.18, 0.183, 0.2])
