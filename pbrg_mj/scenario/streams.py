"""Random streams fixed by the scenario's seed, what draws, for which robot, and when."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Source(IntEnum):
    """What draws random numbers; the number is part of the random stream's key, so it must never change."""

    CAMERA = 1
    BEAMS = 2
    RADIO = 3
    MESSAGES = 4


def stream(seed: int, source: Source, robot: int, frame: int) -> np.random.Generator:
    """Return the random stream of one frame (or one command) of one robot, both counted from 0.

    Philox counts through 2^256 blocks; robot and frame set the upper half of the counter, so streams never
    overlap, and a frame's noise does not depend on which frames were looked at before.
    """
    key = np.array([seed, source], dtype=np.uint64)
    counter = np.array([0, 0, robot, frame], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=counter))
