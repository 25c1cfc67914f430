"""The log's messages over a WebSocket, while a run goes on: for Foxglove and Lichtblick on the same machine.

It has a message stream of its own and hands nothing back: a run makes the same log with it and without it.
"""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Any, Self

import foxglove
from mcap_protobuf.schema import build_file_descriptor_set

from pbrg_mj.errors import InputError
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.message import LogMessage
from pbrg_mj.log.write.messages import MessageStream
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.scenario.schema import Scenario

HOST = "127.0.0.1"  # this machine alone
BACKLOG = 2**14  # messages that wait for a slow viewer; older ones are dropped, the run does not wait


class LiveServer:
    """A context manager and a sink: call it with every TickRecord, in order.

    Raises InputError when the port cannot be had. Port 0 takes any free one.
    """

    def __init__(self, scenario: Scenario, port: int):
        if not 0 <= port <= 65535:
            raise InputError(f"--port is {port}; allowed: 0 to 65535, 0 for any free one")
        self._scenario, self._port = scenario, port
        self._context = foxglove.Context()
        self._stream: MessageStream | None = None
        self._channels: dict[str, Any] = {}
        self._static_scene: LogMessage | None = None
        self._subscribed = threading.Event()

    def __enter__(self) -> Self:
        """Start to listen."""
        listener: Any = _Listener(self._subscribed)  # the SDK calls the methods that are there
        try:
            self._server = foxglove.start_server(
                name="pbrg",
                host=HOST,
                port=self._port,
                capabilities=[foxglove.Capability.Time],
                server_listener=listener,
                context=self._context,
                message_backlog_size=BACKLOG,
            )
        except (RuntimeError, OSError) as error:
            raise InputError(f"cannot listen on {HOST}:{self._port}: {error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the server."""
        self._server.stop()

    @property
    def address(self) -> str:
        """Where viewers connect to."""
        return f"ws://{HOST}:{self._server.port}"

    def __call__(self, record: TickRecord) -> None:
        """Serve one record's messages."""
        if self._stream is None:
            self._stream = MessageStream(self._scenario, record)
            self._channels = {topic: self._channel(topic, kind) for topic, kind in self._stream.types.items()}
        if self._subscribed.is_set() and self._static_scene is not None:
            self._subscribed.clear()
            self._serve(self._static_scene)  # sent once in a run; a viewer that connects later has missed it
        messages = self._stream.messages(record)
        for message in messages:
            self._serve(message)
            if message.topic == channels.SCENE:
                self._static_scene = message
        self._server.broadcast_time(messages[0].log_time)

    def has_subscribers(self) -> bool:
        """Whether some viewer has subscribed to every channel."""
        return bool(self._channels) and all(channel.has_sinks() for channel in self._channels.values())

    def _serve(self, message: LogMessage) -> None:
        self._channels[message.topic].log(message.data, log_time=message.log_time)

    def _channel(self, topic: str, kind: Any) -> Any:
        data = build_file_descriptor_set(kind).SerializeToString()
        schema = foxglove.Schema(name=kind.DESCRIPTOR.full_name, encoding="protobuf", data=data)
        return foxglove.Channel(topic, schema=schema, message_encoding="protobuf", context=self._context)


class _Listener:
    """Notes, on the server's own thread, that a viewer has subscribed to the static scene."""

    def __init__(self, subscribed: threading.Event):
        self._subscribed = subscribed

    def on_subscribe(self, client: Any, channel: Any) -> None:
        if channel.topic == channels.SCENE:
            self._subscribed.set()
