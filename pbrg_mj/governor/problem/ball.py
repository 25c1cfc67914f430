"""From half-spaces to rows of g: which references are safe in the present state.

With constant m, V = rho^2 / 2 never grows, rho(m, p, xi) = ||(1 (x) m - p, xi)||. So a half-space holds for ever, for
every robot, when the whole ball of radius rho around the formation at m lies behind it (eq. 13). That is a theorem of
the continuous team; sampled, gamma rho stands in place of rho, gamma being how much farther a robot may come than rho
(`team/sampled.py`): 1 but at long ticks. docs/theory.md has the proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem.rows import Rows, stacked
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import sampled_growth


def ball_rows(half_spaces: HalfSpaces, formation: np.ndarray) -> Rows:
    """Return eq. 13: rho + G.(m + b_j) - h <= 0 for every half-space of robot i and every robot j that it binds.

    Eq. 12, G.(m + b_j) - h <= 0, is implied since rho >= 0. `formation` is b, (n, 2). Row k * n + j belongs to
    slot k and robot j. The half-spaces may be those of some robots only, their rows (robots, slots * n).
    """
    owners, slots = half_spaces.h.shape
    shape = owners, slots * len(formation)
    C, d = np.empty((*shape, 2)), np.empty(shape)
    _write_ball_rows(half_spaces.G, half_spaces.h, formation, C, d)
    return Rows(np.ones(d.shape), C, d, half_spaces.binds.reshape(d.shape))


@kernel
def _write_ball_rows(G, h, formation, C, d):
    """Write C (owners, nK, 2) and d (owners, nK) [m] of G (owners, K, 2), h (owners, K) for a formation (n, 2) [m]."""
    for i in range(d.shape[0]):
        for row in range(d.shape[1]):
            k, j = divmod(row, len(formation))
            C[i, row, 0], C[i, row, 1] = G[i, k, 0], G[i, k, 1]
            d[i, row] = h[i, k] - (G[i, k, 0] * formation[j, 0] + G[i, k, 1] * formation[j, 1])


def input_rows(network: Network, alpha_r: float, limit: float) -> Rows:
    """Return the rows of the input constraints U_i, eqs. 5-7: ||A|| rho - f <= 0, one for every robot.

    A = F [-(L_i (x) I) - alpha_r delta_i (e_i (x) I)', (L_i (x) I)] maps (p - 1 (x) m, xi) to F u_i, so that the ball
    of radius rho keeps F u_i <= f for ever. ||A|| is the same for every unit row F: all facets of a polygon are one
    and the same row, and that row, with f = `limit` [m/s], keeps the whole disc ||u_i|| <= limit.
    """
    L, n = network.laplacian, network.robots
    own = L + alpha_r * np.diag(network.leader)
    gain = np.sqrt(np.sum(own**2, axis=1) + np.sum(L**2, axis=1))  # ||A|| of robot i [1/s]
    d = np.full((n, 1), limit)
    return Rows(gain[:, None], np.zeros((n, 1, 2)), d, np.ones((n, 1), dtype=bool))


@dataclass(frozen=True)
class BallCertificate:
    """The paper's sufficient condition: the ball of radius rho inside every half-space and input constraint."""

    formation: np.ndarray  # (n, 2) b [m]
    inputs: Rows | None  # of the speed limit, the same at every tick; None without input constraints
    growth: float = 1.0  # gamma, the weight of rho in ball rows

    @classmethod
    def of(cls, scenario: Scenario, network: Network) -> BallCertificate:
        """Return the certificate of a scenario."""
        control, inputs = scenario.control, None
        growth, of_inputs = sampled_growth(network, control, scenario.timing.tick)
        if control.speed_limit is not None:
            inputs = input_rows(network, control.alpha_r, control.speed_limit)
            inputs = inputs._replace(a=of_inputs[:, None] * inputs.a)
        return cls(np.array(scenario.team.formation, dtype=float), inputs, growth)

    def rows(self, half_spaces: HalfSpaces) -> Rows:
        """Return the rows of all g_i: ball rows of the half-spaces first, then those of the inputs."""
        return self._with_inputs(half_spaces, self.inputs)

    def rows_of(self, robot: int, half_spaces: HalfSpaces) -> Rows:
        """Return the rows of one robot, (1, R), from its own half-spaces, arrays with a first axis of 1."""
        inputs = None if self.inputs is None else Rows(*(array[robot : robot + 1] for array in self.inputs))
        return self._with_inputs(half_spaces, inputs)

    def _with_inputs(self, half_spaces: HalfSpaces, inputs: Rows | None) -> Rows:
        rows = ball_rows(half_spaces, self.formation)
        if self.growth != 1.0:
            rows = rows._replace(a=self.growth * rows.a)
        return rows if inputs is None else stacked(rows, inputs)
