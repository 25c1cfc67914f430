"""The state that predictions start from: of kinematic robots p and xi, with motors also what their lag and delay hold.

With the motion (w, d_1, ..., d_d) of `vehicle.motor_lag` a robot that is told to stop now will come to rest at

    y = p + w + d_1 + ... + d_d,

p being where it was d ticks ago. This place moves by h u in a tick, as p of a kinematic robot does, and no other
coordinate depends on where the team is: the state is y, and below it xi, w and the displacements, all 0 at rest.
"""

from __future__ import annotations

import math

import numpy as np


def prediction_state(p: np.ndarray, xi: np.ndarray, motion: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return y (..., n, 2) and the rest of the state (..., N - n, 2) [m].

    p and xi are (..., n, 2), motion (..., n, 1 + d, 2) [m]. The displacements are stacked
    times `displacement_weight`. Without motion: p and xi themselves.
    """
    if motion is None:
        return p, xi
    pairs = [motion[..., k, :] for k in range(motion.shape[-2])]
    y = p.copy()
    for pair in pairs:
        y += pair
    weight = displacement_weight(len(pairs) - 1)
    return y, np.concatenate([xi, pairs[0], *(weight * displacement for displacement in pairs[1:])], axis=-2)


def displacement_weight(delay: int) -> float:
    """Return sqrt(d): with it the norm of d displacements is at least that of their sum."""
    return math.sqrt(delay)
