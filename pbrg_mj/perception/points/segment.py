"""How far a place is off a segment."""

from __future__ import annotations

from pbrg_mj.kernel import kernel


@kernel
def vector_from_segment(segment, x, y):
    """Return the vector to a place from where the segment (4,), x and y of both ends, is nearest to it."""
    dx, dy = segment[2] - segment[0], segment[3] - segment[1]
    x, y, length = x - segment[0], y - segment[1], dx * dx + dy * dy
    share = min(max((x * dx + y * dy) / length, 0.0), 1.0) if length > 0.0 else 0.0
    return x - share * dx, y - share * dy
