"""Python's search for garbage in cycles, kept out of a run's way."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

COLLECTION_THRESHOLD = 20_000  # objects; records of ticks that wait to be evaluated are some 4,000


def settle() -> None:
    """Let what is there by now stay, and look for garbage only once many more objects have come than gone.

    A look through all modules takes 70 ms; Python's default would look through the waiting records every ten ticks.
    """
    gc.freeze()
    gc.set_threshold(COLLECTION_THRESHOLD)


@contextmanager
def collecting_rarely() -> Iterator[None]:
    """Settle for as long as the context lasts."""
    before = gc.get_threshold()
    settle()
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()
