"""Random numbers of a sensor's frames, drawn some frames at a time.

Between two ticks of physics the processor's caches are cold, and setting a stream takes several times as long as among
others. Streams belong to frames, so that it makes no difference when they are drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

Numbers = TypeVar("Numbers")


class FrameBuffer(Generic[Numbers]):
    """What is drawn for a frame, kept for the next frames of a row."""

    def __init__(self, frames: int) -> None:
        """Begin before the first frame, 0; so many `frames` are drawn in a row."""
        self._frames, self._last = frames, -1
        self._drawn: dict[int, Numbers] = {}

    def at(self, frame: int, draw: Callable[[int], Numbers]) -> Numbers:
        """Return what `draw` returns of a frame. Where none was left out, the next ones are drawn with it.

        `draw` must be the same function of the frame in every call.
        """
        if frame not in self._drawn:
            frames = range(frame, frame + (self._frames if frame == self._last + 1 else 1))
            self._drawn = {one: draw(one) for one in frames}
        self._last = frame
        return self._drawn[frame]
