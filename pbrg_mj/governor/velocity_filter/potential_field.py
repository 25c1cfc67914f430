"""An artificial potential field around half-spaces, one a robot: Khatib, Int. J. Robotics Research 5(1), 1986.

Every half-space that a robot knows repels its hand point within the range d_0, d being the distance:

    U(d) = eta / 2 (1 / d - 1 / d_0)^2,    u = u_0 - U'(d) grad d = u_0 - eta (1 / d - 1 / d_0) / d^2  G.

The attraction is u_0, eq. 2 with m = r. A velocity that is held for a tick cannot follow a field steeper than 1 / tick:
nearer than d_1 = (3 eta tick)^(1/4), where U'' <= 1 / tick, and beyond the half-space, u stays what it is at d_1. So
nothing keeps a robot from crossing that is pushed harder than U'(d_1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.governor.velocity_filter.interface import known_half_spaces
from pbrg_mj.kernel import kernel


@dataclass(frozen=True)
class PotentialField:
    """Every robot's field."""

    gain: float  # eta [m^4/s]
    reach: float  # d_0 [m]
    tick: float  # [s]

    def filtered(
        self, problem: Problem, solution: Solution, hand_world: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """Return `velocity` (n, 2) [m/s] with the repulsion from every robot's own half-spaces.

        Raises ValueError for a problem without half-spaces.
        """
        half_spaces = known_half_spaces(problem)
        driven, nearest = velocity.copy(), (3.0 * self.gain * self.tick) ** 0.25
        _add_repulsion(half_spaces, hand_world, (self.gain, self.reach, nearest), driven)
        return driven


@kernel
def _add_repulsion(half_spaces, q, field, driven):
    """Add the repulsion to `driven` (n, 2) [m/s].

    `half_spaces` are G, h, active, binds of HalfSpaces; `field` gain eta [m^4/s], reach d_0 [m], nearest d_1 [m].
    """
    G, h, active, binds = half_spaces
    gain, reach, nearest = field
    for j in range(len(q)):
        for k in range(h.shape[1]):
            if active[j, k] and binds[j, k, j]:
                distance = max(h[j, k] - (G[j, k, 0] * q[j, 0] + G[j, k, 1] * q[j, 1]), nearest)
                if distance < reach:
                    push = gain * (1.0 / distance - 1.0 / reach) / (distance * distance)
                    driven[j, 0] -= push * G[j, k, 0]
                    driven[j, 1] -= push * G[j, k, 1]
