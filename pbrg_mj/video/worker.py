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
from typing import IO, BinaryIO

import numpy as np

from pbrg_mj.errors import InputError, PbrgError
from pbrg_mj.video.gl import environment
from pbrg_mj.video.settings import RenderTask

PREFETCHED = 4  # pictures drawn ahead of those encoded
UNCAUGHT, WRONG_INPUT = 1, 2  # exit codes of the drawing process


@contextmanager
def frames(task: RenderTask, backend: str) -> Iterator[Iterator[np.ndarray]]:
    """Give the task's pictures (height, width, 3) RGB, rows from the top down; a thread fetches them ahead.

    Raises InputError when the drawing process refuses the task, RuntimeError with its traceback as a note when it
    raises, PbrgError when it ends otherwise.
    """
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "pbrg_mj.video.worker"],
            env=environment(backend),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
        )
        assert process.stdin is not None and process.stdout is not None
        fetcher = _Prefetcher(process.stdout, task)
        try:
            _send_task(task, process.stdin)
            fetcher.start()
            yield _pictures(task, process, fetcher, errors)
        finally:
            process.kill()
            process.wait()
            fetcher.close()


class _Prefetcher:
    """A thread that fetches pictures while others are encoded."""

    def __init__(self, source: IO[bytes], task: RenderTask):
        self._source, self._count = source, len(task.times)
        self._size = 3 * task.size[0] * task.size[1]
        self._queue: Queue[bytes] = Queue(PREFETCHED)
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


def _send_task(task: RenderTask, stdin: IO[bytes]) -> None:
    try:
        with stdin:
            pickle.dump(task, stdin)
    except BrokenPipeError:
        pass  # it died; its error comes with the missing first picture


def _pictures(
    task: RenderTask, process: subprocess.Popen[bytes], fetcher: _Prefetcher, errors: BinaryIO
) -> Iterator[np.ndarray]:
    width, height = task.size
    for _ in task.times:
        picture = fetcher.next()
        if picture is None:
            raise _failure(process, errors)
        yield np.frombuffer(picture, dtype=np.uint8).reshape(height, width, 3)[::-1]


def _failure(process: subprocess.Popen[bytes], errors: BinaryIO) -> Exception:
    code = process.wait()
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    if code == WRONG_INPUT and lines:
        return InputError(lines[-1])
    if code == UNCAUGHT and lines:
        failure = RuntimeError(f"in the drawing process: {lines[-1]}")
        failure.add_note("\n".join(lines))
        return failure
    return PbrgError(f"drawing failed: {lines[-1] if lines else f'the process ended with {code}'}")


def draw_all(task: RenderTask, out: BinaryIO) -> None:
    """Draw the task's frames, one after the other, rows from the bottom up, RGB."""
    from pbrg_mj.video.offscreen import OffscreenRenderer

    with OffscreenRenderer(task) as renderer:
        for time in task.times.tolist():
            out.write(renderer.draw(time).data)
        out.flush()


def main() -> int:
    """Draw the task on stdin; `frames` starts this as a process of its own, with MUJOCO_GL set."""
    # Nothing that a library prints may come between the pictures.
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    task = pickle.load(sys.stdin.buffer)
    try:
        draw_all(task, out)
    except InputError as error:
        print(error, file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:
        pass  # the client has gone away
    return 0


if __name__ == "__main__":
    sys.exit(main())
