"""Random streams fixed by the scenario's seed, what draws, for which robot, and when."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np


class Source(IntEnum):
    """What draws random numbers; the number is part of the random stream's key, so it must never change."""

    CAMERA = 1
    BEAMS = 2
    RADIO = 3
    MESSAGES = 4
    JITTER = 5
    WORLDS = 6
    PRE_STABILISER_MESSAGES = 7
    PRE_STABILISER_JITTER = 8
    BEAM_BIAS = 9
    SIGNAL = 10
    LOST_FRAMES = 11
    RADIO_RANGES = 12


class Streams:
    """All random streams of one source, from one generator set anew for each: making one takes ten times longer.

    Philox counts through 2^256 blocks; robot and frame set the upper half of the counter, so streams never
    overlap, and a frame's noise does not depend on which frames were looked at before.
    """

    def __init__(self, seed: int, source: Source):
        """Fix the key; `seed` is below 2^64."""
        philox = np.random.Philox(key=np.array([seed, source], dtype=np.uint64), counter=0)
        self._philox, self._generator = philox, np.random.Generator(philox)
        # Before anything was drawn; as lists, which are read in a third of the time of arrays.
        self._counter = [0, 0, 0, 0]
        key = {"counter": self._counter, "key": [seed, int(source)]}
        self._state: Any = {**philox.state, "state": key, "buffer": [0, 0, 0, 0]}

    def at(self, robot: int, frame: int) -> np.random.Generator:
        """Return the stream of one frame (or one command) of one robot, both counted from 0, until the next call."""
        self._counter[2:] = robot, frame
        self._philox.state = self._state
        return self._generator


def stream(seed: int, source: Source, robot: int, frame: int) -> np.random.Generator:
    """Return one stream for good."""
    return Streams(seed, source).at(robot, frame)
