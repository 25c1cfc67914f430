"""The outline of a convex obstacle of which one or more faces are known."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.corners import crossing, ends, point

DEPTH = 0.3  # [m] what is behind a single face is taken for solid so deep

CORNER = np.dtype(
    [
        ("x", np.float64),
        ("y", np.float64),
        ("s", np.float64),
        ("face", np.int64),
        ("other", np.int64),
        ("hidden", np.int64),
    ]
)
"""A corner at x, y from the anchor [m], s along `face`; `other`: the face it shares it with, or -1; hidden: it has
not been seen but follows from the faces."""


@kernel
def outline(tracks, root, links, hand, rules):
    """Return the corners of the obstacle whose first face is `root`; links are the faces before and after each (M,).

    Faces end at the corner with the next, or where `ends` says. Two faces are closed to a parallelogram, one is DEPTH
    deep, or less if the robot's hand point (2,) is behind it.
    """
    before, after = links
    corners = np.empty(4 * _faces(root, after), dtype=CORNER)
    size, face = 0, root
    start_x, start_y = 0.0, 0.0
    while face >= 0:
        track = tracks[face]
        low, high = ends(track)
        joined = before[face] >= 0
        if joined:
            low = crossing(tracks[before[face]], track)[1]
        if after[face] >= 0:
            high = crossing(track, tracks[after[face]])[0]
        x, y = point(track, low)
        if not joined:  # else it is there as the end of the face before
            size = _add(corners, size, (x, y), (low, face, -1, 0))
        far_x, far_y = point(track, high)
        size = _add(corners, size, (far_x, far_y), (high, face, after[face], 0))
        if joined and face != root:
            size = _add(corners, size, (start_x + far_x - x, start_y + far_y - y), (high, face, -1, 1))
        if not joined and after[face] < 0:
            depth = _depth(track, low, high, hand, rules)
            nx, ny = depth * math.cos(track["angle"]), depth * math.sin(track["angle"])
            size = _add(corners, size, (x + nx, y + ny), (low, face, -1, 1))
            size = _add(corners, size, (far_x + nx, far_y + ny), (high, face, -1, 1))
        start_x, start_y = x, y
        face = after[face]
        if face == root:
            break
    return corners[:size]


@kernel
def _faces(root, after):  # pragma: no cover - compiled
    """Return how many faces an obstacle has from its first on."""
    count, face = 1, after[root]
    while face >= 0 and face != root:
        count, face = count + 1, after[face]
    return count


@kernel
def _add(corners, size, place, what):
    corner = corners[size]
    corner["x"], corner["y"] = place
    corner["s"], corner["face"], corner["other"], corner["hidden"] = what
    return size + 1


@kernel
def _depth(track, low, high, hand, rules):
    """Return how deep a lone face is: where the robot itself has got to behind it, there is nothing."""
    cos, sin = math.cos(track["angle"]), math.sin(track["angle"])
    beyond = hand[0] * cos + hand[1] * sin - track["offset"]
    s = hand[1] * cos - hand[0] * sin
    if low <= s <= high and beyond > rules.clearance:
        return min(DEPTH, beyond - rules.clearance)
    return DEPTH
