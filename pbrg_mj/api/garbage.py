"""Python's search for garbage in cycles, kept out of a run's way."""

from __future__ import annotations

import gc

MANY = 20_000  # objects; the records of ticks that wait to be judged are some 4,000, which come and go


def settle() -> None:
    """Let what is there by now stay, and look for garbage only once many more objects have come than gone.

    A look through all modules takes 70 ms; Python's default would look through the waiting records every ten ticks.
    """
    gc.freeze()
    gc.set_threshold(MANY)
