"""Files that are whole or not there."""

from __future__ import annotations

import errno
import fcntl
import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from pbrg_mj.errors import InputError, write_error
from pbrg_mj.log.write.log_file import check_regular

Choice = TypeVar("Choice")
UNFINISHED = ".pbrg-"  # how the names of files begin that are being written


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file in the same folder, then give it its name.

    What killed processes left half written in that folder goes before. Raises ShortageError on a full disk, InputError
    if it cannot otherwise, and for a pipe or a device, whose place a file must not take.
    """
    check_regular(path)
    try:
        remove_unfinished(path.parent)
        handle, name = _locked_temporary(path)
    except OSError as error:
        raise write_error(error, "cannot write here", path) from error
    try:
        write(Path(name))
        Path(name).chmod(0o666 & ~_umask())
        Path(name).replace(path)
    except BaseException as error:
        Path(name).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise write_error(error, "cannot write", path) from error
        raise
    finally:
        os.close(handle)


def write_text_atomically(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all. Raises what `write_atomically` does."""

    def write(whole: Path) -> None:
        whole.write_text(text, encoding="utf-8")

    write_atomically(path, write)


def remove_unfinished(folder: Path, *, below: bool = False) -> None:
    """Remove what killed processes left half written in a folder; with `below`, also in all folders in it.

    Whoever writes a file holds its lock, which ends with the process, however that ends. Where a file system has no
    locks, nothing is removed.
    """
    pattern = f"{UNFINISHED}*"
    for one in filter(Path.is_file, folder.rglob(pattern) if below else folder.glob(pattern)):
        with suppress(OSError), one.open("r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            one.unlink()


def _locked_temporary(path: Path) -> tuple[int, str]:
    """Return handle and name of a new file beside `path`, empty, locked as long as the handle is open."""
    while True:
        handle, name = tempfile.mkstemp(prefix=UNFINISHED, suffix=path.suffix, dir=path.parent)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        if os.fstat(handle).st_nlink:
            return handle, name
        os.close(handle)  # another process took it for one of a dead process, before it was locked


def check_place(path: Path) -> None:
    """Raise InputError, as `write_atomically` would, unless a file can be made here; before work that takes long."""
    check_regular(path)
    if path.is_dir():
        raise InputError(f"cannot write: {os.strerror(errno.EISDIR)}", file=str(path))
    folder = path.parent
    if not os.access(folder, os.W_OK | os.X_OK):
        error = errno.EACCES if folder.is_dir() else errno.ENOTDIR if folder.exists() else errno.ENOENT
        raise InputError(f"cannot write here: {os.strerror(error)}", file=str(path))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def by_suffix(path: Path, writers: Mapping[str, Choice]) -> Choice:
    """Return the writer for the file's suffix. Raises InputError for another suffix."""
    if path.suffix.lower() not in writers:
        allowed = ", ".join(writers)
        raise InputError(f"the name ends in {path.suffix or 'nothing'!r}; allowed: {allowed}", file=str(path))
    return writers[path.suffix.lower()]
