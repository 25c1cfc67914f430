"""The live view serves the log's own bytes, and leaves the run alone."""

from __future__ import annotations

import json
import struct
import time
from pathlib import Path
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
        data = socket.recv(timeout=10)
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
        data = socket.recv(timeout=10)
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
            deadline = time.monotonic() + 10
            while not serve.has_subscribers() and time.monotonic() < deadline:
                time.sleep(0.01)
            for record in rest:
                serve(record)
            scene = [message for message in logged if message[0] == "/scene"]  # again, for the newcomer
            expected = scene + [message for message in logged if message[1] > 0]
            assert collect(socket, topics, len(expected)) == expected
    assert set(offers) == {topic for topic, _, _ in logged}
    assert offers["/scan/robot_3"]["schemaName"] == "foxglove.LaserScan"
    assert {one["encoding"] for one in offers.values()} == {"protobuf"}


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


def test_a_pace_holds_records_back_until_they_are_due() -> None:
    wait = pacer(0.5)
    began = time.perf_counter()
    for record in records(6):  # 10 ms each
        wait(record)
    assert 0.1 <= time.perf_counter() - began < 0.5
