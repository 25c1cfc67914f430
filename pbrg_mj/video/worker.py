"""The drawing process and its client: a task goes in, raw pictures come out."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import Empty, Queue
from threading import Thread
from typing import IO, TYPE_CHECKING, BinaryIO

import numpy as np

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.video.gl import environment
from pbrg_mj.video.settings import RenderTask

AHEAD = 4  # pictures drawn ahead of those encoded


@contextmanager
def frames(job: RenderTask, backend: str) -> Iterator[Iterator[np.ndarray]]:
    """Give the job's pictures (height, width, 3) RGB, rows from the top down; a thread fetches them ahead.

    Raises InputError when the drawing process refuses the job, PbrgError when it fails.
    """
    with tempfile.TemporaryFile() as words:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "pbrg_mj.video.worker"],
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

    def __init__(self, source: IO[bytes], job: RenderTask):
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


def _hand_over(job: RenderTask, stdin: IO[bytes]) -> None:
    try:
        with stdin:
            pickle.dump(job, stdin)
    except BrokenPipeError:
        pass  # it died; what it said comes with the missing first picture


def _pictures(
    job: RenderTask, process: subprocess.Popen[bytes], ahead: _Ahead, words: BinaryIO
) -> Iterator[np.ndarray]:
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


if TYPE_CHECKING:
    from pbrg_mj.video.settings import RenderTask

WRONG_INPUT = 2


def draw_all(job: RenderTask, out: BinaryIO) -> None:
    """Draw the job's frames, one after the other, rows from the bottom up, RGB."""
    from pbrg_mj.video.offscreen import OffscreenRenderer

    with OffscreenRenderer(job) as stage:
        for time in job.times.tolist():
            out.write(stage.draw(time).data)
        out.flush()


def main() -> int:
    """Do the one job; started by `pbrg_mj.video.worker` with MUJOCO_GL set."""
    # Nothing that a library prints may come between the pictures.
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    job = pickle.load(sys.stdin.buffer)
    try:
        draw_all(job, out)
    except InputError as error:
        print(error, file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:
        pass  # whoever wanted pictures has gone away
    return 0


if __name__ == "__main__":
    sys.exit(main())
