"""Random numbers of a sensor's frames, drawn some frames at a time.

Between two ticks of physics the processor's caches are cold, and setting a stream takes several times as long as among
others. Streams belong to frames, so that it makes no difference when they are drawn.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.random_streams import Streams

FRAMES = 16  # drawn in a row


class NormalBuffer:
    """Standard normal numbers of every robot and frame."""

    def __init__(self, streams: Streams, numbers: int) -> None:
        """Draw so many `numbers` for every robot and frame."""
        self._streams, self._numbers, self._last = streams, numbers, -1
        self._drawn: dict[int, np.ndarray] = {}

    def at(self, frame: int, robots: int) -> np.ndarray:
        """Return those of a frame, (robots, numbers). Where none was left out, the next ones are drawn with it."""
        if frame not in self._drawn:
            frames = range(frame, frame + (FRAMES if frame == self._last + 1 else 1))
            self._drawn = {one: self._draw(one, robots) for one in frames}
        self._last = frame
        return self._drawn[frame]

    def _draw(self, frame: int, robots: int) -> np.ndarray:
        draws = np.empty((robots, self._numbers))
        for robot in range(robots):
            self._streams.at(robot, frame).standard_normal(out=draws[robot])
        return draws
