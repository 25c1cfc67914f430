"""From half-spaces to rows of g: the ball of the motion across each half-space alone.

The two coordinates of eq. 9 decouple (A is A_c (x) I_2), so under constant m no component x_G = (G.m - G.p_j, G.xi_j)
of x grows, whatever the direction G: d||x_G||^2 / dt = -2 G.e' (L + alpha_r D) G.e - 2 leak G.xi' L G.xi <= 0, e = p -
1 (x) m. So ||x_G|| stands in place of rho, which is never smaller, and motion along a wall costs nothing. Sampled, the
same gamma stands before it as before rho, for a robot's place is a row e_j' of x in any direction. docs/theory.md has
the proof. A robot computes ||x_G|| at its own estimate z_i; nothing else is sent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem.ball import ball_rows, input_rows
from pbrg_mj.governor.problem.rows import Rows, stacked
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import sampled_growth


@dataclass(frozen=True)
class DirectionalBallCertificate:
    """gamma ||x_G|| + G.(m + b_j) <= h - margin for every half-space and every robot j that it binds."""

    formation: np.ndarray  # (n, 2) b [m]
    inputs: Rows | None  # of the speed limit, the same at every tick; None without input constraints
    margin: float  # kept from every half-space [m]
    growth: float = 1.0  # gamma, the weight of ||x_G||

    @classmethod
    def of(cls, scenario: Scenario, network: Network, margin: float) -> DirectionalBallCertificate:
        """Return the certificate of a scenario."""
        control, inputs = scenario.control, None
        growth, of_inputs = sampled_growth(network, control, scenario.timing.tick)
        if control.speed_limit is not None:
            inputs = facet_rows(network, control.alpha_r, control.speed_limit, control.speed_facets)
            inputs = inputs._replace(a=of_inputs[:, None] * inputs.a)
        return cls(np.array(scenario.team.formation, dtype=float), inputs, margin, growth)

    def rows(self, half_spaces: HalfSpaces) -> Rows:
        """Return the rows of all g_i: those of the half-spaces, as many as ball rows, then those of the inputs."""
        ball = ball_rows(half_spaces, self.formation)
        rows = ball._replace(a=self.growth * ball.a, d=ball.d - self.margin, along=ball.C)
        return rows if self.inputs is None else stacked(rows, self.inputs)


def facet_rows(network: Network, alpha_r: float, limit: float, sides: int) -> Rows:
    """Return the rows of the input constraints F.u_i <= f of a polygon in the disc of radius `limit` [m/s]: eqs. 5-7.

    F.u_i is A_i x_F, so ||A_i|| ||x_F|| - f <= 0 for the normal F of every one of its `sides`, f = limit cos(pi /
    sides). Opposite sides have one row.
    """
    count = sides // 2 if sides % 2 == 0 else sides
    angle = 2.0 * np.pi * np.arange(count) / sides
    disc = input_rows(network, alpha_r, limit * math.cos(math.pi / sides))
    a, d, active = (np.repeat(array, count, axis=1) for array in (disc.a, disc.d, disc.active))
    along = np.broadcast_to(np.column_stack([np.cos(angle), np.sin(angle)]), (len(a), count, 2))
    return Rows(a, np.zeros((len(a), count, 2)), d, active, along)
