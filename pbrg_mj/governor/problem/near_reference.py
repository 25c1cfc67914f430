"""How far away the operator's reference may pull: at most `governor.reference_range` from the leader that hears it.

A leader takes r as the nearest point to it within a disc about its own p. Then no reference, however far, pulls harder
than a near one, and none can be too strong for capped multipliers; docs/theory.md proves it, and that the team rests at
the same places. A leader needs nothing but its own p.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel


def near_references(p: np.ndarray, reference: np.ndarray, reference_range: float) -> np.ndarray:
    """Return r as each robot would take it, (n, 2) [m], from its own p (n, 2) [m]; r (2,) itself where it is near."""
    near = np.empty(p.shape)
    write_near_references(p, reference, reference_range, near)
    return near


@kernel
def write_near_references(p, reference, reference_range, near):
    """Write what `near_references` returns to `near` (n, 2), of p (n, 2) and the reference (2,)."""
    for i in range(len(p)):
        x, y = reference[0] - p[i, 0], reference[1] - p[i, 1]
        distance = math.sqrt(x * x + y * y)
        if distance <= reference_range:
            near[i, 0], near[i, 1] = reference[0], reference[1]
        else:
            share = reference_range / distance
            near[i, 0], near[i, 1] = p[i, 0] + share * x, p[i, 1] + share * y
