"""The paper's ball (eq. 13) as rows at a state, one for each half-space: what the certified layer verifies.

`problem.ball` has the same rows with one for every robot that a half-space binds. They share rho and G, so the one
with the least slack implies the others. `growth` is gamma Gamma: with gamma rho + G.m <= c the paper's row of the
sampled team (`team/sampled.py`) and Gamma = sup_t ||A^t||, gamma Gamma rho + G.m <= c makes the paper's row hold at
every later tick while m is held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.rows import Rows, stacked
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network


@dataclass(frozen=True)
class BallAtState:
    """The ball for a formation and a margin, and the input constraints of all robots."""

    formation: np.ndarray  # (n, 2) b [m]
    growth: float  # gamma Gamma
    margin: float  # [m]
    inputs: tuple[float, float] | None  # ||A|| Gamma of the strictest robot [1/s], limit [m/s]; None without a limit

    @classmethod
    def of(cls, scenario: Scenario, network: Network, margin: float) -> BallAtState:
        """Return the certificate of a scenario. Raises ValueError when its sampled team does not settle."""
        paper, growth = BallCertificate.of(scenario, network), TeamModel.of_scenario(scenario).growth
        inputs = None
        if paper.inputs is not None:
            inputs = growth * float(paper.inputs.a.max()), float(paper.inputs.d[0, 0])
        return cls(paper.formation, growth * paper.growth, margin, inputs)

    def rows_at(self, half_spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, held: np.ndarray) -> Rows:
        """Return the rows of some robots' half-spaces, (owners, K), and a last one of the inputs if there is a limit.

        They depend on p and xi through rho alone, and not on the m that is held.
        """
        spaces = half_spaces
        farthest = np.where(spaces.binds, spaces.G @ self.formation.T, -np.inf).max(axis=2, initial=-np.inf)
        active = spaces.active & np.isfinite(farthest)
        d = np.where(active, spaces.h - farthest - self.margin, 0.0)
        rows = Rows(np.full(d.shape, self.growth), spaces.G.copy(), d, active)
        if self.inputs is None:
            return rows
        gain, limit = self.inputs
        one = (len(d), 1)
        last = Rows(np.full(one, gain), np.zeros((*one, 2)), np.full(one, limit), np.ones(one, dtype=bool))
        return stacked(rows, last)
