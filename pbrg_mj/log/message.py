"""One message, on its way into a log or out of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Message:
    """Serialised data on a channel. Both times are simulated time."""

    topic: str
    data: bytes
    index: int  # of the tick: MCAP's sequence number
    log_time: int  # [ns]
    publish_time: int  # [ns]
