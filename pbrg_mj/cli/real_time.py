"""A run held back to the wall clock, for those who watch."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj import TickRecord


def pacer(pace: float | None) -> Callable[[TickRecord], None]:
    """Return a function that waits until a record is due, `pace` simulated seconds a second; None never waits."""
    if pace is None:
        return lambda _record: None
    if not 0 < pace < float("inf"):
        raise InputError(f"--pace is {pace:g}; allowed: more than 0, 1 for real time")
    began: float | None = None

    def wait(record: TickRecord) -> None:
        nonlocal began
        now = time.perf_counter()
        began = now if began is None else began
        time.sleep(max(0.0, began + record.time / pace - now))

    return wait
