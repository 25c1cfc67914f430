"""The predictive certificate: every predicted position of every robot stays behind every half-space that binds it.

Per half-space it is an interval of the advance z = G.(m - m_held). With the error e and y at the held m, one row of
the grid asks for

    y + E e + s z + bound (||e|| + sqrt(n) |z|) <= c_j,     c_j = h - G.b_j - margin,

which is convex in z; sqrt(n) is the length of the fixed point per metre of m. Holding, z = 0, stays admissible for ever
once it was (the rows bound all that follows), so an answer always exists; a row whose step response s is small would
ask for long retreats from little noise, so it may stop an advance and never asks for a retreat.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pbrg_mj.governor.certificate.advances import Advances, interval_rows
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid, write_error, write_times_error
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario

MIN_STEP_RESPONSE = 0.1  # step response below which a row asks for no retreat


@dataclass(frozen=True)
class PredictiveCertificate:
    """Rows of a prediction grid, for a formation and a margin."""

    grid: PredictionGrid
    formation: np.ndarray  # (n, 2) b [m]
    margin: float  # [m]

    @classmethod
    def of(cls, scenario: Scenario, margin: float) -> PredictiveCertificate:
        """Return the certificate of a scenario. Raises ValueError when its sampled team does not settle."""
        formation = np.array(scenario.team.formation, dtype=float)
        return cls(PredictionGrid.of(TeamModel.of_scenario(scenario)), formation, margin)

    @cached_property
    def grid_rows(self) -> tuple[np.ndarray, ...]:
        """What advances count with: columns of E (n, N, K), bound, s, s + bound sqrt(n), s - bound sqrt(n), (n, K)."""
        grid, spread = self.grid, self.grid.bound * np.sqrt(len(self.formation))
        return grid.columns, grid.bound, grid.s, grid.s + spread, grid.s - spread

    @cached_property
    def packed(self) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, float]]:
        """What kernels take: the grid's rows, and the formation with the margin."""
        return self.grid_rows, (self.formation, self.margin)

    def rows_at(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Rows:
        """Return the rows with the states p (n, 2), xi (N - n, 2) [m] while m (2,) [m] is held.

        Behind motors they are those of `Problem.prediction_state`.
        """
        return interval_rows(half_spaces, held, self.advances(half_spaces, p, xi, held))

    def advances(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Advances:
        """Return how far m may move along each normal; the arguments are those of `rows_at`."""
        allowed = Advances.empty(half_spaces.h.shape)
        spaces = half_spaces.G, half_spaces.h, half_spaces.active, half_spaces.binds
        write_advances(spaces, (p, xi, held), *self.packed, tuple(allowed))
        return allowed


@kernel
def write_advances(half_spaces, state, rows, team, allowed):
    """Write low and high (n, K) of `Advances` to `allowed`.

    `half_spaces` are G, h, active, binds of HalfSpaces; `state` p (n, 2), xi (N - n, 2) and the held m (2,) [m]; `rows`
    (five arrays, unpacked in `_interval_of_robot`) those of `PredictiveCertificate.grid_rows`; `team` the formation
    (n, 2) and margin [m].
    """
    G, h, active, binds = half_spaces
    p, xi, m = state
    formation, margin = team
    low, high = allowed
    n, points = rows[1].shape
    error, moved, known = np.empty((n + len(xi), 2)), np.empty((n, 2, points)), np.zeros(n, dtype=np.bool_)
    rest = np.empty(points)
    write_error(p, xi, m, error)
    for i in range(h.shape[0]):
        for k in range(h.shape[1]):
            low[i, k], high[i, k] = -np.inf, np.inf
            if not active[i, k]:
                continue
            Gx, Gy = G[i, k, 0], G[i, k, 1]
            square = 0.0
            for row in range(len(error)):
                square += (Gx * error[row, 0] + Gy * error[row, 1]) ** 2
            norm, slack = np.sqrt(square), h[i, k] - margin - (Gx * m[0] + Gy * m[1])
            lowest, highest = -np.inf, np.inf
            for j in range(n):
                if binds[i, k, j]:
                    if not known[j]:
                        write_times_error(rows[0], j, error, moved[j])
                        known[j] = True
                    c = slack - (Gx * formation[j, 0] + Gy * formation[j, 1])
                    down, up = _interval_of_robot((Gx, Gy, c, norm), j, moved, rows, rest)
                    lowest, highest = max(lowest, down), min(highest, up)
            low[i, k], high[i, k] = lowest, highest


@kernel
def _interval_of_robot(half_space, j, moved, rows, rest):
    """Return the least and the largest advance that the rows of robot j allow.

    `half_space` is its normal Gx, Gy, how far it is from the held m to the robot's limit, c [m], and norm = ||e||;
    `rows` are those of `PredictiveCertificate.grid_rows`: bound, s, up, down (n, Q) at the grid's Q ticks, up = s +
    sqrt n bound and down = s - sqrt n bound; `moved` (n, 2, Q) is E_j(t) times the error [m], `rest` (Q,) is scratch.
    """
    Gx, Gy, c, norm = half_space
    _, bound, s, up, down = rows
    lowest, highest = -np.inf, np.inf
    for r in range(len(rest)):
        rest[r] = c - (Gx * moved[j, 0, r] + Gy * moved[j, 1, r]) - bound[j, r] * norm
    for r in range(len(rest)):
        lowest, highest = narrowed(lowest, highest, rest[r], s[j, r], up[j, r], down[j, r])
    return lowest, highest


@kernel
def narrowed(lowest, highest, rest, s, up, down):
    """Return the interval of advances within (lowest, highest) that one row allows.

    It asks for up z <= rest where z > 0, and down z <= rest where z < 0; `s` is its step response.
    """
    if rest >= 0.0:
        if up > 0.0 and rest < highest * up:
            highest = rest / up
        if down < 0.0 and rest < lowest * down:
            lowest = rest / down
    else:
        if s >= MIN_STEP_RESPONSE and down > 0.0:
            highest = min(highest, rest / down)
        elif s >= MIN_STEP_RESPONSE:  # its bound grows faster than a retreat helps: none is allowed
            lowest, highest = max(lowest, 0.0), min(highest, rest)
        elif up > 0.0:
            highest = min(highest, 0.0)
        if down < 0.0:
            lowest = max(lowest, rest / up if s <= -MIN_STEP_RESPONSE else 0.0)
    return lowest, highest
