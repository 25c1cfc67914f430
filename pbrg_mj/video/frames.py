"""Pictures from the drawing process, as they come."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Queue
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
        try:
            assert process.stdin is not None and process.stdout is not None
            _hand_over(job, process.stdin)
            yield _pictures(job, process, process.stdout, words)
        finally:
            process.kill()
            process.wait()


def _hand_over(job: Job, stdin: IO[bytes]) -> None:
    try:
        with stdin:
            pickle.dump(job, stdin)
    except BrokenPipeError:
        pass  # it died; what it said comes with the missing first picture


def _pictures(job: Job, process: subprocess.Popen[bytes], source: IO[bytes], words: BinaryIO) -> Iterator[np.ndarray]:
    queue: Queue[bytes] = Queue(AHEAD)
    width, height = job.size
    size = width * height * 3

    def fetch() -> None:
        for _ in job.times:
            queue.put(source.read(size))

    Thread(target=fetch, daemon=True).start()
    for _ in job.times:
        picture = queue.get()
        if len(picture) < size:
            raise _failure(process, words)
        yield np.frombuffer(picture, dtype=np.uint8).reshape(height, width, 3)[::-1]


def _failure(process: subprocess.Popen[bytes], words: BinaryIO) -> PbrgError:
    code = process.wait()
    words.seek(0)
    lines = words.read().decode(errors="replace").strip().splitlines()
    if code == WRONG_INPUT and lines:
        return InputError(lines[-1])
    return PbrgError(f"drawing failed: {lines[-1] if lines else f'the process ended with {code}'}")
