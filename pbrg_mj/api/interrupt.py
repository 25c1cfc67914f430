"""Ctrl-C, SIGTERM and SIGHUP: between ticks, never in the middle of one."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from pbrg_mj.errors import Interrupted as Interrupted
from pbrg_mj.errors import Stopped

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def stop(number: int, _frame: object) -> None:
    """Handle a signal at once: raise Stopped."""
    raise Stopped(signal=number)


@contextmanager
def stoppable() -> Iterator[None]:
    """Make SIGTERM and SIGHUP raise what Ctrl-C raises, so that what is under way is put in order."""
    with _handled(stop):
        yield


@contextmanager
def interruptible() -> Iterator[Callable[[], int]]:
    """Give a function that returns the number of the signal that came, 0 if none. A second one interrupts at once.

    Only a program's main thread gets signals: in any other one none ever comes.
    """
    came = 0

    def note(number: int, _frame: object) -> None:
        nonlocal came
        came = number
        for one in handled:
            signal.signal(one, stop)

    with _handled(note) as handled:
        yield lambda: came


@contextmanager
def _handled(handler: Callable[[int, object], None]) -> Iterator[list[signal.Signals]]:
    """Handle the signals so, and give them: those that would end the program, and every handler of Ctrl-C.

    A signal that is ignored, as under nohup, stays ignored; a program that handles SIGTERM goes on doing so.
    """
    if threading.current_thread() is not threading.main_thread():
        yield []
        return
    before: dict[signal.Signals, Any] = {one: signal.getsignal(one) for one in SIGNALS}
    ends = (signal.SIG_DFL, signal.default_int_handler, stop)
    handled = [one for one, was in before.items() if was in ends or (one == signal.SIGINT and callable(was))]
    for one in handled:
        signal.signal(one, handler)
    try:
        yield handled
    finally:
        for one in handled:
            signal.signal(one, before[one])
