"""Finished runs on disk, a line each: what is there is not run again.

A line is written when its run is over, and is whole or, after a kill, the last one and cut short: that one is left out.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from pbrg_mj.errors import InputError, write_error
from pbrg_mj.studies.run_task import Record, Result

FILE = "runs.jsonl"


class Journal:
    """The finished runs of a folder, open and locked against other studies for as long as the context lasts."""

    def __init__(self, folder: Path, header: Mapping[str, Any]):
        """`header` says what the runs were made with: another one's are refused."""
        self.path = folder / FILE
        self._header = dict(header)
        self._done: dict[str, tuple[Record, Record]] = {}
        self._stream: BinaryIO | None = None

    def __enter__(self) -> Journal:
        """Open the file and read it. Raises InputError when another study writes it, or wrote it otherwise."""
        try:
            if self.path.exists() and not self.path.is_file():
                raise InputError("is no file; allowed: a new folder", file=str(self.path))
            self._stream = os.fdopen(os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666), "r+b")
        except OSError as error:
            raise write_error(error, "cannot be written", self.path) from None
        try:
            self._read(self._stream)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file, which unlocks it."""
        if self._stream is not None:
            with suppress(OSError):  # what the buffer still holds is a line that was refused
                self._stream.close()

    def __contains__(self, digest: str) -> bool:
        """Whether a run is finished."""
        return digest in self._done

    def __getitem__(self, digest: str) -> tuple[Record, Record]:
        """Return a finished run's record and its timings."""
        return self._done[digest]

    def add(self, result: Result) -> None:
        """Write down a finished run, for good before this returns. Raises ShortageError on a full disk."""
        self._write({"run": result.digest, "record": result.record, "timings": result.timings})
        self._done[result.digest] = (result.record, result.timings)

    def _read(self, stream: BinaryIO) -> None:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError("another study writes into this folder just now", file=str(self.path)) from None
        content = stream.read()
        whole = content.rfind(b"\n") + 1
        stream.truncate(whole)
        stream.seek(whole)
        lines = content[:whole].splitlines()
        if not lines:
            self._write(self._header)
            return
        try:
            header, *runs = map(json.loads, lines)
            self._done = {one["run"]: (one["record"], one["timings"]) for one in runs}
        except (ValueError, KeyError, TypeError):
            raise InputError(
                "is no list of finished runs; allowed: a new folder, or --force", file=str(self.path)
            ) from None
        if header != self._header:
            changed = sorted(name for name in {*header, *self._header} if header.get(name) != self._header.get(name))
            text = f"these runs were made with another {', '.join(changed)}; allowed: a new folder, or --force"
            raise InputError(text, file=str(self.path))

    def _write(self, line: Mapping[str, Any]) -> None:
        assert self._stream is not None
        try:
            self._stream.write(json.dumps(line, allow_nan=False).encode() + b"\n")
            self._stream.flush()
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise write_error(error, "cannot be written", self.path) from error
