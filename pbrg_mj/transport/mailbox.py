"""A UDP socket: on the loopback interface, where nothing comes from other machines, unless another one is asked for."""

from __future__ import annotations

import errno
import socket
from time import monotonic_ns

from pbrg_mj.errors import InputError
from pbrg_mj.transport.address import HOST, Address, reason
from pbrg_mj.transport.datagrams import LARGEST, WORLD, Datagram, packed, unpacked

UNREACHABLE = (errno.ECONNREFUSED, errno.EHOSTUNREACH, errno.ENETUNREACH)
BUFFER = 1 << 20  # bytes that wait for a process that is busy


class Mailbox:
    """Sends and receives datagrams. Close it after use."""

    def __init__(self, port: int = 0, host: str = HOST):
        """Bind to a port of one of this machine's IPv4 addresses; 0 takes any free one.

        Raises InputError when it is taken, not allowed, or not this machine's.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        try:
            self._socket.bind((host, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            named = "this machine" if host == HOST else host
            raise InputError(f"UDP port {port} of {named}: {reason(error)}; allowed: a free port, or 0") from None
        self.address = Address(*self._socket.getsockname())

    def send(self, to: Address, one: Datagram) -> None:
        """Send a datagram, stamped with the clock. Raises InputError for one that is too large.

        Whether somebody listens there is not known: a receiver that is gone is no error.
        """
        content = packed(one._replace(sent_ns=monotonic_ns()))
        if len(content) > LARGEST:
            sender = "the world" if one.robot == WORLD else f"robot {one.robot + 1}"
            raise InputError(f"{sender}'s message has {len(content)} bytes; a datagram takes {LARGEST}: fewer robots")
        try:
            self._socket.sendto(content, to)
        except OSError as error:
            if error.errno not in UNREACHABLE:
                raise

    def receive(self, timeout: float) -> tuple[Datagram, Address] | None:
        """Return the next datagram and where it came from; None when none comes in so many seconds [s]."""
        self._socket.settimeout(max(timeout, 0.0))
        try:
            content, came_from = self._socket.recvfrom(LARGEST)
        except (TimeoutError, BlockingIOError, ConnectionRefusedError):
            return None
        one = unpacked(content)
        return None if one is None else (one, Address(*came_from))

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()
