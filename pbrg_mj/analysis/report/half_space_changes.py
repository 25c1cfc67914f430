"""The half-spaces over the frames of the animation, as the changes from one frame to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.log.read.run import Run

MOST_CHANGES = 60_000  # of a whole page


@dataclass(frozen=True)
class HalfSpaceChanges:
    """From frame `frame` on, slot `slot` (robot * K + place) holds G q <= h; G is NaN when it becomes empty."""

    frame: np.ndarray  # (C,) in order
    slot: np.ndarray  # (C,)
    G: np.ndarray  # (C, 2)
    h: np.ndarray  # (C,) [m]

    def table(self) -> np.ndarray:
        """Return (C, 5): frame, slot, G, h."""
        return np.column_stack([self.frame, self.slot, self.G, self.h])


def half_space_changes(run: Run, frames: np.ndarray, most: int) -> HalfSpaceChanges:
    """Return the changes; when they are more than `most`, of every second frame, or fourth, and so on."""
    every = 1
    while True:
        shown = np.arange(0, len(frames), every)
        changes = _changes(run, frames[shown], shown)
        if len(changes.frame) <= most or every >= len(frames):
            return changes
        every *= 2


def _changes(run: Run, ticks: np.ndarray, frames: np.ndarray) -> HalfSpaceChanges:
    t = run.ticks
    active = t.half_space_active[ticks].reshape(len(ticks), -1)
    values = np.concatenate([t.half_space_G[ticks], t.half_space_h[ticks][..., None]], axis=-1)
    values = np.where(active[..., None], values.reshape(*active.shape, 3), np.nan)
    before = np.concatenate([np.full((1, *values.shape[1:]), np.nan), values[:-1]])
    changed = ~((values == before) | (np.isnan(values) & np.isnan(before))).all(axis=-1)
    row, slot = np.nonzero(changed)
    new = values[row, slot]
    return HalfSpaceChanges(frames[row], slot, new[:, :2], new[:, 2])
