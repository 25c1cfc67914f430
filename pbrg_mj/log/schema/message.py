"""One message, on its way into a log or out of it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

NANOSECONDS = 1_000_000_000  # in a second


class LogMessage(NamedTuple):
    """Serialized data on a channel. Both times are simulated time; messages of one tick share theirs."""

    topic: str
    data: bytes
    log_time: int  # [ns]
    publish_time: int  # [ns]


def set_timestamp(message: Any, time_ns: int) -> None:
    """Set a message's timestamp."""
    message.timestamp.seconds, message.timestamp.nanos = divmod(time_ns, NANOSECONDS)


@lru_cache(maxsize=8)
def timestamp_bytes(time_ns: int) -> bytes:
    """Return the bytes of a timestamp in a message's first field, which is where Foxglove's schemas have it."""
    message = LaserScan()
    set_timestamp(message, time_ns)
    return message.SerializeToString(deterministic=True)
