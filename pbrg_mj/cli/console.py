"""What goes to the terminal: clean stdout, one-line notes on stderr, no control characters from files."""

from __future__ import annotations

import json
import logging
import os
import re
import sys
from typing import Any, TextIO

from pbrg_mj.cli.stdout import result_stream
from pbrg_mj.errors import PbrgError
from pbrg_mj.text import plain

LONGEST = 400  # characters of an exception's or a warning's text shown
FRAMES = re.compile(r"^Traceback \(most recent call last\):\n(?:[ \t].*\n|\n)*", re.MULTILINE)


class StdoutClosedError(Exception):
    """Nobody reads stdout any more, as behind `| head`: a command ends without a word, as Unix tools do."""


def emit(text: str) -> None:
    """Print lines to stdout. Raises StdoutClosedError, and PbrgError when stdout is closed or its disk full."""
    _print(plain(text, keep="\n") + "\n")


def emit_json(data: Any) -> None:
    """Print data as JSON to stdout; ASCII, and null for what is not a number. Raises what `emit` does."""
    _print(json.dumps(data, indent=2, allow_nan=False) + "\n")


def note(text: str) -> None:
    """Print one line to stderr, if anybody takes it."""
    if sys.stderr is None:
        return
    try:
        _write(sys.stderr, plain(text) + "\n")
    except OSError:
        discard(sys.stderr)


def one_line(text: str) -> str:
    """Return another package's text in one line, cut off where long; of a traceback in it only what was raised."""
    line = " ".join(FRAMES.sub("", text).split())
    return line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."


class WarningNotes(logging.Handler):
    """Prints what the package warns of, a line each."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message."""
        note(f"warning: {record.getMessage()}")


def keep_standard_streams() -> None:
    """Open what the shell closed (`>&-`), for else the next file opened would take its number, and what it prints."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDONLY)  # takes the lowest number that is free; writing to it fails


def discard(stream: TextIO) -> None:
    """Let what is still in the stream's buffer go nowhere; Python would complain of it when it flushes at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _print(text: str) -> None:
    stdout = result_stream()
    if stdout is None:
        raise PbrgError("cannot write to standard output: it is closed")
    try:
        _write(stdout, text)
    except BrokenPipeError:
        discard(stdout)
        raise StdoutClosedError from None
    except OSError as error:
        discard(stdout)
        raise PbrgError(f"cannot write to standard output: {error.strerror}") from error


def _write(stream: TextIO, text: str) -> None:
    encoding = stream.encoding or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
    stream.flush()
