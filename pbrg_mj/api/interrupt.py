"""Ctrl-C between ticks, never in the middle of one."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run between two ticks; what is written so far is whole. `str(error)` says what there is."""


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Give a function that returns whether Ctrl-C was pressed. A second Ctrl-C interrupts at once.

    Only a program's main thread gets Ctrl-C: in any other one it is never pressed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    pressed = False
    before = signal.getsignal(signal.SIGINT)

    def press(_signal: int, _frame: object) -> None:
        nonlocal pressed
        pressed = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, press)
    try:
        yield lambda: pressed
    finally:
        signal.signal(signal.SIGINT, before)
