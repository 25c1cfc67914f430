"""The file of a log: under a temporary name, locked, while it is written; moved into place when it is whole."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from pbrg_mj.errors import InputError, PbrgError, write_error


def partial_path(path: Path) -> Path:
    """Return what a log is called while it is written, and for good when its run is killed: `near.mcap.part`."""
    return path.with_name(f"{path.name}.part")


def check_writable(path: Path, *, force: bool) -> None:
    """Raise InputError unless a file could be created at `path`; `force` allows to replace one that exists."""
    folder = path.parent
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a folder")
    check_regular(path)
    if not folder.is_dir():
        raise InputError(f"cannot write {path}: there is no folder {folder}")
    if path.exists() and not force:
        raise InputError("exists; --force (in Python: force=True) overwrites it", file=str(path))
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"cannot write {path}: permission denied")


def check_regular(path: Path) -> None:
    """Raise InputError for a pipe, which would wait for a reader, and for a device, whose place no file must take."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError("is a pipe or a device; allowed: a new name, or a file to replace", file=str(path))


class LogFile:
    """A log's file from `open` to one of `keep`, `leave` and `discard`.

    Meanwhile it has the name of `partial_path`, and a lock which ends with this process, however that ends. So two runs
    never write into one file, and a log under its own name is whole. `force` allows to replace what is there.
    """

    def __init__(self, path: Path, *, force: bool):
        self.path, self._force = path, force
        self._target = Path(os.path.realpath(path))  # a link stays one
        self.partial = partial_path(self._target)

    def open(self) -> BinaryIO:
        """Create the temporary file, empty, and return it.

        Raises InputError when a file cannot be written or may not be replaced, or another run writes it;
        ShortageError on a full disk.
        """
        check_writable(self._target, force=self._force)
        check_regular(self.partial)
        try:
            handle = os.open(self.partial, os.O_WRONLY | os.O_CREAT, 0o666)
        except OSError as error:
            raise write_error(error, "cannot write", self.path) from error
        self._file = os.fdopen(handle, "wb")
        try:
            self._take()
        except BaseException:
            self._file.close()
            raise
        return self._file

    def keep(self) -> None:
        """Move the file, which is whole, into place, and close it.

        Raises PbrgError when another file has got there without permission to replace it; OSError.
        """
        with self._file:
            self._file.flush()
            if not self._force and self._target.exists():
                raise PbrgError(f"{self.path} has appeared meanwhile; the log stays in {self.partial}")
            self.partial.replace(self._target)

    def close_partial(self) -> None:
        """Close the file, which is not whole, under its temporary name."""
        with suppress(OSError):
            self._file.close()

    def discard(self) -> None:
        """Remove the file."""
        with suppress(OSError):
            self.partial.unlink(missing_ok=True)
        self.close_partial()

    def _take(self) -> None:
        """Lock the file and empty it; raise InputError when it is another run's."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError("another run is writing this log", file=str(self.path)) from None
        except OSError:  # a file system without locks
            pass
        found = os.fstat(self._file.fileno())
        if not self.partial.exists() or not os.path.samestat(found, self.partial.stat()):
            raise InputError("another run has just written this log", file=str(self.path))
        if found.st_size and not self._force:
            kept = f"`pbrg repair {self.partial} -o OUT.mcap` makes a log of it, --force overwrites it"
            raise InputError(f"holds what a killed run wrote; {kept}", file=str(self.partial))
        self._file.truncate(0)
