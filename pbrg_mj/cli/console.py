"""What goes to the terminal: clean stdout, one-line notes on stderr, no control characters from files."""

from __future__ import annotations

import json
import logging
import os
import sys
from typing import Any, TextIO

from pbrg_mj.api.text import plain


def emit(text: str) -> None:
    """Print lines to stdout. A reader that has gone away (`| head`) is no error."""
    _write(sys.stdout, plain(text, keep="\n") + "\n")


def emit_json(data: Any) -> None:
    """Print data as JSON to stdout; ASCII, and null for what is not a number."""
    _write(sys.stdout, json.dumps(data, indent=2, allow_nan=False) + "\n")


def note(text: str) -> None:
    """Print one line to stderr."""
    _write(sys.stderr, plain(text) + "\n")


class Notes(logging.Handler):
    """Prints what the package warns of, a line each."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message."""
        note(f"warning: {record.getMessage()}")


def _write(stream: TextIO, text: str) -> None:
    encoding = stream.encoding or "utf-8"
    try:
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        stream.flush()
    except BrokenPipeError:
        # Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
