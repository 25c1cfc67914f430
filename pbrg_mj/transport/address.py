"""Where a process is: an IPv4 address and a UDP port."""

from __future__ import annotations

import errno
import socket
from typing import NamedTuple

from pbrg_mj.errors import InputError

HOST = "127.0.0.1"
"""The loopback interface, which no other machine reaches."""


class Address(NamedTuple):
    """Where a mailbox is."""

    host: str  # IPv4 address
    port: int

    @classmethod
    def of(cls, text: str) -> Address:
        """Return the address of `HOST:PORT`. Raises InputError."""
        host, _, port = text.rpartition(":")
        if not host or not (port.isascii() and port.isdigit() and int(port) < 1 << 16):
            raise InputError(f"{text!r} is no address; allowed: HOST:PORT, such as 192.168.0.7:7400")
        try:
            return cls(socket.gethostbyname(host), int(port))
        except (OSError, UnicodeError) as error:
            raise InputError(f"{text!r}: no such host: {reason(error)}") from None

    def local_host(self) -> str:
        """Return this machine's own address on the way there. Raises InputError when there is no way."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                if not self.port:
                    raise InputError(f"no way to {self}: nobody is at port 0")
                probe.connect(self)  # which sends nothing
            except OSError as error:
                raise InputError(f"no way to {self}: {reason(error)}") from None
            return probe.getsockname()[0]

    def __str__(self) -> str:
        """Return `HOST:PORT`."""
        return f"{self.host}:{self.port}"


def reason(error: Exception) -> str:
    """Return in words why a socket cannot do what it is asked."""
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return "another process has it"
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
