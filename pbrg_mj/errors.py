"""Errors a user can cause, each in one line; and what ends a run from outside."""

from __future__ import annotations

from signal import SIGINT, Signals


class PbrgError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(PbrgError):
    """The input is wrong: bad file, key, value or argument. The command line exits with 2.

    `str(error)` is one line: `file:line: key: what is wrong and what is allowed`, as far as each is known.
    """

    def __init__(self, message: str, *, file: str | None = None, line: int | None = None, key: str | None = None):
        self.message, self.file, self.line, self.key = message, file, line, key
        where = f"{file}:{line}" if file and line else file
        super().__init__(": ".join(part for part in (where, key, message) if part).replace("\n", " "))


class PlugInError(PbrgError):
    """A part of another package broke its contract. The command line exits with 1."""


class Stopped(KeyboardInterrupt):
    """Ctrl-C, SIGTERM or SIGHUP: `signal` says which. The command line exits with 128 and its number."""

    def __init__(self, message: str = "", signal: int = SIGINT):
        super().__init__(message)
        self.signal = Signals(signal)


class Interrupted(Stopped):
    """One of them ended a run between two ticks; what is written so far is whole. `str(error)` says what there is."""
