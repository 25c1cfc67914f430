"""Pictures from the drawing process, as they come."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import Empty, Queue
from threading import Thread
from typing import IO, BinaryIO

import numpy as np

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.video.draw import WRONG_INPUT
from pbrg_mj.video.gl import environment
from pbrg_mj.video.job import Job

AHEAD = 4  # pictures drawn ahead of those encoded


@contextmanager
def frames(job: Job, backend: str) -> Iterator[Iterator[np.ndarray]]:
    """Give the job's pictures (height, width, 3) RGB, rows from the top down; a thread fetches them ahead.

    Raises InputError when the drawing process refuses the job, PbrgError when it fails.
    """
    with tempfile.TemporaryFile() as words:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "pbrg_mj.video.draw"],
            env=environment(backend),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=words,
        )
        assert process.stdin is not None and process.stdout is not None
        ahead = _Ahead(process.stdout, job)
        try:
            _hand_over(job, process.stdin)
            ahead.start()
            yield _pictures(job, process, ahead, words)
        finally:
            process.kill()
            process.wait()
            ahead.close()


class _Ahead:
    """A thread that fetches pictures while others are encoded."""

    def __init__(self, source: IO[bytes], job: Job):
        self._source, self._count = source, len(job.times)
        self._size = 3 * job.size[0] * job.size[1]
        self._queue: Queue[bytes] = Queue(AHEAD)
        self._thread = Thread(target=self._fetch, daemon=True)
        self.start = self._thread.start

    def next(self) -> bytes | None:
        """Return the next picture; None when the drawing process ended early."""
        picture = self._queue.get()
        return picture if len(picture) == self._size else None

    def close(self) -> None:
        """Let the thread end, whatever it waits for; the drawing process has ended."""
        while self._thread.is_alive():
            with suppress(Empty):
                self._queue.get(timeout=0.01)
        self._source.close()

    def _fetch(self) -> None:
        for _ in range(self._count):
            picture = self._source.read(self._size)
            self._queue.put(picture)
            if len(picture) < self._size:
                return


def _hand_over(job: Job, stdin: IO[bytes]) -> None:
    try:
        with stdin:
            pickle.dump(job, stdin)
    except BrokenPipeError:
        pass  # it died; what it said comes with the missing first picture


def _pictures(job: Job, process: subprocess.Popen[bytes], ahead: _Ahead, words: BinaryIO) -> Iterator[np.ndarray]:
    width, height = job.size
    for _ in job.times:
        picture = ahead.next()
        if picture is None:
            raise _failure(process, words)
        yield np.frombuffer(picture, dtype=np.uint8).reshape(height, width, 3)[::-1]


def _failure(process: subprocess.Popen[bytes], words: BinaryIO) -> PbrgError:
    code = process.wait()
    words.seek(0)
    lines = words.read().decode(errors="replace").strip().splitlines()
    if code == WRONG_INPUT and lines:
        return InputError(lines[-1])
    return PbrgError(f"drawing failed: {lines[-1] if lines else f'the process ended with {code}'}")
