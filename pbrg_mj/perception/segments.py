"""Split and merge: straight pieces of a cluster."""

from __future__ import annotations

import numpy as np

Piece = tuple[int, int]  # start, stop in the turned points


def split_and_merge(xy: np.ndarray, clusters: list[Piece], distance: float) -> list[Piece]:
    """Return the straight pieces of every cluster, in order; no point of a piece is farther than `distance` [m]
    from the chord between the piece's ends. xy (N, 2) [m].
    """  # fmt: skip
    pieces: list[Piece] = []
    for start, stop in clusters:
        pieces += _merge(xy, _split(xy, start, stop, distance), distance)
    return pieces


def _split(xy: np.ndarray, start: int, stop: int, distance: float) -> list[Piece]:
    """Cut at the point farthest from the chord until none is too far (iterative end point fit)."""
    done: list[Piece] = []
    todo = [(start, stop)]
    while todo:
        low, high = todo.pop()
        off, farthest = _farthest(xy, low, high)
        if off <= distance:
            done.append((low, high))
        else:
            todo += [(farthest, high), (low, farthest)]  # the left part is taken first: pieces stay in order
    return done


def _merge(xy: np.ndarray, pieces: list[Piece], distance: float) -> list[Piece]:
    """Join neighbours that are straight together: a split may leave a wall's last point with the next wall."""
    merged = pieces[:1]
    for low, high in pieces[1:]:
        before = merged[-1][0]
        if _farthest(xy, before, high)[0] <= distance:
            merged[-1] = (before, high)
        else:
            merged.append((low, high))
    return merged


def _farthest(xy: np.ndarray, low: int, high: int) -> tuple[float, int]:
    """Return the distance [m] from the chord of points low..high-1 and the point that has it, never an end."""
    if high - low < 3:
        return 0.0, low
    chord = xy[high - 1] - xy[low]
    inner = xy[low + 1 : high - 1] - xy[low]
    length = float(np.hypot(chord[0], chord[1]))
    if length > 0:
        off = np.abs(inner[:, 0] * chord[1] - inner[:, 1] * chord[0]) / length
    else:
        off = np.hypot(inner[:, 0], inner[:, 1])
    index = int(np.argmax(off))
    return float(off[index]), low + 1 + index
