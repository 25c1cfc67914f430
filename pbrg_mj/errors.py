"""Errors a user can cause, each in one line; and what ends a run from outside."""

from __future__ import annotations

import errno
from signal import SIGINT, Signals

# The machine is short of something: neither wrong input nor a defect.
SHORTAGES = {
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EIO,
    errno.ENOMEM,
    errno.EMFILE,
    errno.ENFILE,
    errno.EAGAIN,
}


class PbrgError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(PbrgError):
    """The input is wrong: bad file, key, value or argument. The command line exits with 2.

    `str(error)` is one line: `file:line: key: what is wrong and what is allowed`, as far as each is known. `others` are
    what else is wrong with the same file, in the order of its lines.
    """

    others: tuple[InputError, ...] = ()

    def __init__(self, message: str, *, file: str | None = None, line: int | None = None, key: str | None = None):
        self.message, self.file, self.line, self.key = message, file, line, key
        where = f"{file}:{line}" if file and line else file
        super().__init__(": ".join(part for part in (where, key, message) if part).replace("\n", " "))


class PlugInError(PbrgError):
    """A part of another package broke its contract. The command line exits with 1."""


class ShortageError(PbrgError):
    """The machine ran short of something, such as a disk that is full. The command line exits with 1."""


def write_error(error: OSError, what: str, file: object) -> InputError | ShortageError:
    """Return what to raise for a file that could not be written; `what` says so, such as `cannot write`."""
    text = f"{what}: {error.strerror or error}"
    return ShortageError(f"{file}: {text}") if error.errno in SHORTAGES else InputError(text, file=str(file))


class Stopped(KeyboardInterrupt):
    """Ctrl-C, SIGTERM or SIGHUP: `signal` says which. The command line exits with 128 and its number."""

    def __init__(self, message: str = "", signal: int = SIGINT):
        super().__init__(message)
        self.signal = Signals(signal)


class Interrupted(Stopped):
    """One of them ended a run between two ticks; what is written so far is whole. `str(error)` says what there is."""
