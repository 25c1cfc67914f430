"""Standard output is for results alone: what else prints there while a command runs goes to stderr.

A plug-in that prints, its libraries and the programs it starts would otherwise stand between the lines of `--json`.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TextIO, TypeVar

STDOUT, STDERR = 1, 2

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_stdout: list[TextIO | None] = []  # what was `sys.stdout` before the command that runs, or a copy of it


def result_stream() -> TextIO | None:
    """Return the stream for results; None where stdout was closed before this program began."""
    return _stdout[-1] if _stdout else sys.stdout


def protect_stdout(command: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return a command during which only what is written to `result_stream()` reaches stdout."""

    @wraps(command)
    def apart(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with _stdout_kept():
            return command(*arguments, **options)

    return apart


@contextmanager
def _stdout_kept() -> Iterator[None]:
    before = sys.stdout
    with _descriptor_kept(before) as stream:
        _stdout.append(stream)
        sys.stdout = sys.stderr
        try:
            yield
        finally:
            sys.stdout = before
            _stdout.pop()


@contextmanager
def _descriptor_kept(stream: TextIO | None) -> Iterator[TextIO | None]:
    """Let descriptor 1 be stderr's, for compiled code and other programs; give a stream that still goes to stdout.

    A stream that is not on descriptor 1, as a notebook's, is given as it is.
    """
    if stream is None or _descriptor(stream) != STDOUT:
        yield stream
        return
    stream.flush()
    with os.fdopen(os.dup(STDOUT), "w", encoding=stream.encoding, errors=stream.errors) as kept:
        os.dup2(STDERR, STDOUT)
        try:
            yield kept
        finally:
            ctypes.CDLL(None).fflush(None)  # what C's own buffers hold belongs to stderr, too
            os.dup2(kept.fileno(), STDOUT)


def _descriptor(stream: TextIO) -> int | None:
    try:
        return stream.fileno()
    except (OSError, ValueError):  # a stream in memory, a closed one
        return None
