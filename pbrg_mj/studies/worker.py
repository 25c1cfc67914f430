"""A process that makes runs for another one: signals are left to that one, and it ends when that one is gone."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from time import sleep

from pbrg_mj.api.interrupt import SIGNALS
from pbrg_mj.plugin_failures import forget_calls, tell_thread_failures

LOOK_UP = 0.5  # [s] between looks whether the parent is still there
TRIES = 100  # to remove a folder that a run still writes into
FAILED = 1  # exit code, which nobody is there to read
_under_way: dict[int, list[str]] = {}  # of each run in this process: the first failure of a plug-in's thread


def become_worker(parent: int, place: str | None = None) -> None:
    """Leave Ctrl-C and the like to the parent, and end with it, also where it is killed in the middle of a run.

    `parent`: the number of the process that started this one; of this process itself, nothing is done. `place`: the
    folder of this process's files, which is made if it is not there and goes when the parent is gone. A worker may be
    told so again, with another folder.
    """
    if parent == os.getpid():
        return
    for one in SIGNALS:
        signal.signal(one, signal.SIG_IGN)
    watch = _watch(parent)
    if place is not None:
        watch.make(Path(place))


@contextmanager
def catch_thread_failures() -> Iterator[list[str]]:
    """Keep the first failure of a plug-in's thread, in one line, for as long as the context lasts.

    Where a process makes several runs at a time each is given it: whose the thread was cannot be told.
    """
    _hear_threads()
    if not _under_way:
        forget_calls()
    kept: list[str] = []
    _under_way[id(kept)] = kept
    try:
        yield kept
    finally:
        del _under_way[id(kept)]


@cache
def _hear_threads() -> None:
    tell_thread_failures(_keep)


def _keep(failure: str) -> None:
    listening = list(_under_way.values())
    for kept in listening:
        if not kept:
            kept.append(failure)
    if not listening:  # its run is over, and nobody asks any more
        print(f"error: {failure}", file=sys.stderr, flush=True)


class _Watch(threading.Thread):
    """Waits beside the runs for the parent's end: one that nobody takes a result from would wait for ever."""

    def __init__(self, parent: int):
        super().__init__(daemon=True)
        self.parent = parent
        self._place: Path | None = None
        self._making = threading.Lock()

    def make(self, place: Path) -> None:
        """Make the folder, which goes when the parent is gone; not any more once that has begun."""
        with self._making:
            self._place = place
            place.mkdir(mode=0o700, exist_ok=True)

    def run(self) -> None:
        while os.getppid() == self.parent:
            sleep(LOOK_UP)
        with self._making:  # and never again: the process ends with it
            for _ in range(TRIES):  # a run may make files meanwhile; where other workers do, the last one removes them
                if self._place is None or not self._place.exists():
                    break
                shutil.rmtree(self._place, ignore_errors=True)
            os._exit(FAILED)


@cache
def _watch(parent: int) -> _Watch:
    watch = _Watch(parent)
    watch.start()
    return watch
