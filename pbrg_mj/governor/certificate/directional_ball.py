"""The directional ball: the paper's ball for the motion across one half-space alone.

The coordinates decouple, so of the error e = (G.p - y 1, G.xi) alone the norm never grows under constant m, y = G.m:
d||e||^2 / dt = -2 G.p' (L + alpha_r D) G.p - 2 leak G.xi' L G.xi <= 0 in error coordinates. A half-space holds for ever
when

    Gamma ||e|| + y <= c_j,    c_j = h - G.b_j - margin,

for every robot j that it binds; Gamma = sup_t ||A^t|| >= 1 is what sampling adds, 1 in continuous time. It is
never tighter than eq. 13 with Gamma = 1, since ||e|| <= rho, and motion along the wall is free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.advances import Advances, interval_rows
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario

LINEAR_TOLERANCE = 1e-12  # of a parabola's first coefficient: a straight line


@dataclass(frozen=True)
class DirectionalBall:
    """The directional ball for a formation and a margin."""

    formation: np.ndarray  # (n, 2) b [m]
    growth: float  # Gamma
    margin: float  # [m]

    @classmethod
    def of(cls, scenario: Scenario, margin: float) -> DirectionalBall:
        """Return the certificate of a scenario. Raises ValueError when its sampled team does not settle."""
        growth = TeamModel.of_scenario(scenario).growth
        return cls(np.array(scenario.team.formation, dtype=float), growth, margin)

    def rows_at(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Rows:
        """Return the rows with the states p, xi (n, 2) [m] while m (2,) [m] is held."""
        return interval_rows(half_spaces, held, self.advances(half_spaces, p, xi, held))

    def advances(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Advances:
        """Return how far m may move along each normal; the arguments are those of `rows_at`."""
        allowed = Advances.empty(half_spaces.h.shape)
        spaces = half_spaces.G, half_spaces.h, half_spaces.active, half_spaces.binds
        _write_advances(spaces, (p, xi, held), (self.formation, self.growth, self.margin), tuple(allowed))
        return allowed


@kernel
def _write_advances(half_spaces, state, team, allowed):
    """Write low and high (n, K) of `Advances` to `allowed`.

    `half_spaces` are G, h, active, binds of HalfSpaces; `state` p, xi (n, 2) and the held m (2,) [m]; `team` formation
    (n, 2) [m], gamma and margin [m].
    """
    G, h, active, binds = half_spaces
    p, xi, m = state
    formation, gamma, margin = team
    low, high = allowed
    n = len(formation)
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            low[i, k], high[i, k] = -np.inf, np.inf
            if not active[i, k]:
                continue
            Gx, Gy = G[i, k, 0], G[i, k, 1]
            y = Gx * m[0] + Gy * m[1]
            total = square = 0.0
            for j in range(n):
                e = Gx * p[j, 0] + Gy * p[j, 1] - y
                total += e
                square += e * e + (Gx * xi[j, 0] + Gy * xi[j, 1]) ** 2
            lowest, highest = -np.inf, np.inf
            for j in range(n):
                if binds[i, k, j]:
                    slack = h[i, k] - (Gx * formation[j, 0] + Gy * formation[j, 1]) - margin - y
                    down, up = interval(n, total, square, gamma, slack)
                    lowest, highest = max(lowest, down), min(highest, up)
            low[i, k], high[i, k] = lowest, highest


@kernel
def interval(n, total, square, gamma, slack):
    """Return the least and the largest z with gamma sqrt(square - 2 total z + n z^2) + z <= slack.

    Without such a z, return (z + v, z - v), low above high: v is how much is violated with m at the mean of G.p, and z
    is the place that would in formation have as much to spare. What is least violated is a team at rest where it is.
    """
    a = gamma * gamma
    first, half, last = a * n - 1.0, slack - a * total, a * square - slack * slack
    if first > LINEAR_TOLERANCE:
        root = half * half - first * last
        # The squares also hold where z >= slack; the interval lies on one side of it.
        if root >= 0.0 and -half / first <= slack:
            reach = np.sqrt(root) / first
            return -half / first - reach, -half / first + reach
    elif half > 0.0:  # one robot, gamma = 1
        return -np.inf, min(-last / (2.0 * half), slack)
    rest, mean = max(square - total * total / n, 0.0), total / n
    violation = gamma * np.sqrt(rest) + mean - slack
    z = slack - violation
    return z + violation, z - violation
