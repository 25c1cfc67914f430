"""How far away the operator's reference may pull: at most `governor.reference_range`.

Under the paper's algorithm a leader takes r as the nearest point to it within a disc about its own p, of which alone it
knows. Then no reference, however far, pulls harder than a near one, and none can be too strong for capped multipliers;
docs/theory.md proves it, and that the team rests at the same places. Governors that decide with all p at hand need it
for another reason: a normal that is wrong by some angle moves the best m by that angle times the distance of r. They
take the disc about the mean of p, of `FARTHEST`, and exact data as they are.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel

FARTHEST = 20.0  # [m]; a normal that is wrong by 0.14 deg moves the best m by the tolerance of an outcome, 5 cm


def near_references(p: np.ndarray, reference: np.ndarray, reference_range: float) -> np.ndarray:
    """Return r as each robot would take it, (n, 2) [m], from its own p (n, 2) [m]; r (2,) itself where it is near."""
    near = np.empty(p.shape)
    write_near_references(p, reference, reference_range, near)
    return near


@kernel
def write_near_references(p, reference, reference_range, near):
    """Write what `near_references` returns to `near` (n, 2), of p (n, 2) and the reference (2,)."""
    for i in range(len(p)):
        near[i, 0], near[i, 1] = near_point(p[i, 0], p[i, 1], reference[0], reference[1], reference_range)


def farthest_reference(plant: str) -> float:
    """Return from how far a governor that knows all p takes the reference [m]; in the ideal plant data are exact."""
    return math.inf if plant == "ideal" else FARTHEST


@kernel
def near_point(x, y, far_x, far_y, reach):
    """Return the far point itself if it is within `reach` of (x, y), else the point so far on the way to it."""
    to_x, to_y = far_x - x, far_y - y
    distance = math.sqrt(to_x * to_x + to_y * to_y)
    if distance <= reach:
        return far_x, far_y
    share = reach / distance
    return x + share * to_x, y + share * to_y
