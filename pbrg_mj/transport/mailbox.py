"""A UDP socket on the loopback interface: nothing from other machines, nothing to them."""

from __future__ import annotations

import errno
import socket
from contextlib import suppress
from time import monotonic_ns

from pbrg_mj.errors import InputError
from pbrg_mj.transport.datagrams import LARGEST, Datagram, packed, unpacked

HOST = "127.0.0.1"
BUFFER = 1 << 20  # bytes that wait for a process that is busy


class Mailbox:
    """Sends and receives datagrams. Close it after use."""

    def __init__(self, port: int = 0):
        """Bind to a port; 0 takes any free one. Raises InputError when it is taken or not allowed."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        try:
            self._socket.bind((HOST, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise InputError(f"UDP port {port} of this machine: {_reason(error)}; allowed: a free port, or 0") from None
        self.port: int = self._socket.getsockname()[1]

    def send(self, port: int, one: Datagram) -> None:
        """Send a datagram, stamped with the clock. Raises InputError for one that is too large.

        Whether somebody listens there is not known: a receiver that is gone is no error.
        """
        content = packed(one._replace(sent_ns=monotonic_ns()))
        if len(content) > LARGEST:
            raise InputError(
                f"robot {one.robot + 1}'s message has {len(content)} bytes; a datagram takes {LARGEST}: fewer robots"
            )
        with suppress(ConnectionRefusedError):
            self._socket.sendto(content, (HOST, port))

    def receive(self, patience: float) -> tuple[Datagram, int] | None:
        """Return the next datagram and the port it came from; None when none comes in so many seconds [s]."""
        self._socket.settimeout(max(patience, 0.0))
        try:
            content, (_, port) = self._socket.recvfrom(LARGEST)
        except (TimeoutError, BlockingIOError, ConnectionRefusedError):
            return None
        one = unpacked(content)
        return None if one is None else (one, port)

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return "somebody else has it"
    return str(error)
