"""The log's messages over a WebSocket, while a run goes on: for Foxglove and Lichtblick on the same machine.

It has a message stream of its own and hands nothing back: a run makes the same log with it and without it. What it
speaks of Foxglove's protocol (github.com/foxglove/ws-protocol) is all that a viewer needs to look on: channels are
advertised, subscribed to, and their messages sent.

A web page open in a browser on this machine can reach a server on its loopback. It cannot hide where it comes
from: the browser says so in the handshake's Origin. Pages from elsewhere are refused.
"""

from __future__ import annotations

import json
import logging
import re
import threading
from base64 import b64encode
from collections import deque
from contextlib import suppress
from struct import pack
from types import TracebackType
from typing import Any, Self

from mcap_protobuf.schema import build_file_descriptor_set
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

from pbrg_mj.errors import InputError
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.message import LogMessage
from pbrg_mj.log.write.messages import MessageStream
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.schema import Scenario

HOST = "127.0.0.1"  # this machine alone
ORIGINS = (
    None,  # no browser
    "https://app.foxglove.dev",
    "file://",  # desktop applications
    re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?"),  # a viewer served from this machine
)
PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
BACKLOG = 2**14  # messages that wait for a slow viewer; older ones are dropped, the run does not wait
SERVER_LOG = logging.getLogger("pbrg_mj.log.live")  # who comes, goes or is refused is no news of the run
SERVER_LOG.setLevel(logging.CRITICAL + 1)


class LiveServer:
    """A context manager and a sink: call it with every TickRecord, in order.

    Raises InputError when the port cannot be had. Port 0 takes any free one.
    """

    def __init__(self, scenario: Scenario, port: int):
        if not 0 <= port <= 65535:
            raise InputError(f"--port is {port}; allowed: 0 to 65535, 0 for any free one")
        self._scenario, self._port = scenario, port
        self._stream: MessageStream | None = None
        self._numbers: dict[str, int] = {}  # of channels, by topic
        self._offer = ""  # what advertises them
        self._static_scene: bytes | None = None
        self._viewers: set[_Viewer] = set()
        self._lock = threading.Lock()  # on what the run's thread and those of viewers share

    def __enter__(self) -> Self:
        """Start to listen."""
        options: dict[str, Any] = {
            "origins": ORIGINS,
            "subprotocols": PROTOCOLS,
            "compression": None,
            "logger": SERVER_LOG,
        }
        try:
            self._server: Server = serve(self._serve_viewer, HOST, self._port, **options)
        except OSError as error:
            raise InputError(f"cannot listen on {HOST}:{self._port}: {error.strerror}") from error
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._thread.join()

    @property
    def address(self) -> str:
        """Where viewers connect to."""
        return f"ws://{HOST}:{self._server.socket.getsockname()[1]}"

    def __call__(self, record: TickRecord) -> None:
        """Serve one record's messages."""
        if self._stream is None:
            self._stream = MessageStream(self._scenario, record)
        messages = self._stream.messages(record)
        with self._lock:
            if not self._offer:
                self._advertise(self._stream.types)
            for message in messages:
                number, data = self._numbers[message.topic], _timed(message)
                if message.topic == channels.SCENE:
                    self._static_scene = data
                for viewer in self._viewers:
                    viewer.put(number, data)
            for viewer in self._viewers:
                viewer.enqueue(pack("<BQ", 2, messages[0].log_time))

    def _advertise(self, types: dict[str, Any]) -> None:
        """Number the channels, in the order of their topics' types, and tell those who are there."""
        self._numbers = {topic: number for number, topic in enumerate(types, start=1)}
        offers = [_offer(number, topic, types[topic]) for topic, number in self._numbers.items()]
        self._offer = json.dumps({"op": "advertise", "channels": offers})
        for viewer in self._viewers:
            viewer.enqueue(self._offer)

    def _serve_viewer(self, connection: ServerConnection) -> None:
        """Take in what one viewer asks for, until it leaves."""
        viewer = _Viewer(connection)
        with self._lock:
            viewer.enqueue(json.dumps({"op": "serverInfo", "name": "pbrg", "capabilities": ["time"]}))
            if self._offer:
                viewer.enqueue(self._offer)
            self._viewers.add(viewer)
        try:
            for asked in connection:
                with self._lock, suppress(ValueError, TypeError, KeyError, AttributeError):  # not of the protocol
                    self._take(viewer, json.loads(asked))
        finally:
            with self._lock:
                self._viewers.discard(viewer)
            viewer.stop()

    def _take(self, viewer: _Viewer, asked: dict[str, Any]) -> None:
        if asked["op"] == "subscribe":
            for one in asked["subscriptions"]:
                number = int(one["channelId"])
                viewer.subscribed[number] = int(one["id"])
                if number == self._numbers.get(channels.SCENE) and self._static_scene is not None:
                    viewer.put(number, self._static_scene)  # sent once in a run; who comes later has missed it
        if asked["op"] == "unsubscribe":
            gone = set(asked["subscriptionIds"])
            viewer.subscribed = {number: one for number, one in viewer.subscribed.items() if one not in gone}


class _Viewer:
    """One connection, and what waits to be sent on it by a thread of its own."""

    def __init__(self, connection: ServerConnection):
        self.subscribed: dict[int, int] = {}  # channels' numbers -> the viewer's own for its subscriptions
        self._connection = connection
        self._waiting: deque[str | bytes] = deque(maxlen=BACKLOG)
        self._news, self._gone = threading.Condition(), False
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def put(self, number: int, data: bytes) -> None:
        """Send a channel's message if it is subscribed to."""
        if number in self.subscribed:
            self.enqueue(pack("<BI", 1, self.subscribed[number]) + data)

    def enqueue(self, data: str | bytes) -> None:
        """Send text or bytes when their turn comes."""
        with self._news:
            self._waiting.append(data)
            self._news.notify()

    def stop(self) -> None:
        """Send nothing more."""
        with self._news:
            self._gone = True
            self._news.notify()
        self._thread.join()

    def _send(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                with self._news:
                    self._news.wait_for(lambda: self._gone or self._waiting)
                    if self._gone:
                        return
                    data = self._waiting.popleft()
                self._connection.send(data)


def _timed(message: LogMessage) -> bytes:
    return pack("<Q", message.log_time) + message.data


def _offer(number: int, topic: str, kind: Any) -> dict[str, Any]:
    schema = b64encode(build_file_descriptor_set(kind).SerializeToString()).decode("ascii")
    names = {"schemaName": kind.DESCRIPTOR.full_name, "schema": schema, "schemaEncoding": "protobuf"}
    return {"id": number, "topic": topic, "encoding": "protobuf", **names}
