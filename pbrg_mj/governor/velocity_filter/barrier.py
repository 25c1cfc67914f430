"""Control barrier functions, one filter a robot: Ames, Xu, Grizzle and Tabuada, IEEE TAC 62(8), 2017; ECC 2019.

The distance d_k = h_k - margin - G_k.q of a hand point to each half-space that its robot knows may fall no faster than
at the rate gamma:

    minimise ||u - u_0||^2    subject to    G_k.u <= gamma d_k    for all k,

u_0 from eq. 2. With dq/dt = u, d_k(t) >= d_k(0) exp(-gamma t): who starts behind a half-space stays there. With u held
for a tick, d_k falls by at most the factor 1 - gamma tick, which keeps its sign for gamma tick <= 1 (Agrawal and
Sreenath, RSS 2017). Inside all half-spaces u = 0 is allowed; beyond some, no u may be: then the worst row is
violated least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.projection import least_violating, nearest_allowed
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.governor.velocity_filter.interface import known_half_spaces
from pbrg_mj.kernel import kernel


@dataclass(frozen=True)
class BarrierFilter:
    """Every robot's barrier functions."""

    gain: float  # gamma [1/s]
    margin: float  # [m]

    def filtered(
        self, problem: Problem, solution: Solution, hand_world: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """Return the nearest velocities (n, 2) [m/s] to `velocity` that every robot's own half-spaces allow.

        Raises ValueError for a problem without half-spaces.
        """
        half_spaces, driven = known_half_spaces(problem), np.empty(velocity.shape)
        _write_nearest(half_spaces, hand_world, velocity, self.gain, self.margin, driven)
        return driven


@kernel
def _write_nearest(half_spaces, q, velocity, gain, margin, driven):
    """Write the filtered velocities, driven (n, 2), of the wanted ones, velocity (n, 2) [m/s].

    `half_spaces` are G, h, active, binds of HalfSpaces.
    """
    G, h, active, binds = half_spaces
    normals, offsets = np.empty((h.shape[1], 2)), np.empty(h.shape[1])
    for j in range(len(q)):
        rows = 0
        for k in range(h.shape[1]):
            if active[j, k] and binds[j, k, j]:
                normals[rows] = G[j, k]
                offsets[rows] = gain * (h[j, k] - margin - (G[j, k, 0] * q[j, 0] + G[j, k, 1] * q[j, 1]))
                rows += 1
        ux, uy = velocity[j, 0], velocity[j, 1]
        found, x, y = nearest_allowed(ux, uy, normals[:rows], offsets[:rows], 0.0)
        if not found:
            for k in range(rows):
                offsets[k] -= normals[k, 0] * ux + normals[k, 1] * uy
            x, y = least_violating(normals[:rows], offsets[:rows], np.inf)
            x, y = ux + x, uy + y
        driven[j, 0], driven[j, 1] = x, y
