"""The schema of what robots in processes of their own say to each other and to the world (docs/hardware.md)."""

from __future__ import annotations

from pathlib import Path

from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.transport.schema import file_descriptor, proto_text


def datagram_schema() -> str:
    """Return the text of `pbrg/datagram.proto`: the protobuf messages on the wire, one a UDP datagram."""
    return proto_text(file_descriptor())


def write_datagram_schema(path: str | Path) -> None:
    """Write that text to a file. Raises InputError when it cannot."""
    write_text_atomically(Path(path), datagram_schema())
