"""How fast NIDS can be near the optimum: its slowest mode that a leader's iterate shows, with one row active.

Across the active row its owner's iterate is held by the projection; along it all iterates are free, and the
leader's cost alone pulls. In both directions an iteration is a linear map of (z, m, m before).
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.team.network import Network

CURVATURE = 2.0  # of the cost ||r - m||^2
SHOWN = 1e-6  # a mode's share in the leader's iterate
AGREEMENT = 1e-7  # modes as near to 1 are what all iterates have in common, and do not move


def nids_rate(team: Network, owner: int, step: float, weight: float) -> float:
    """Return the factor by which the slowest of these modes falls in an iteration; leader is the team's first."""
    leader = int(np.flatnonzero(team.leader)[0])
    return max(_slowest(team, leader, step, weight, held) for held in ([], [owner]))


def _slowest(team: Network, leader: int, step: float, weight: float, held: list[int]) -> float:
    n, eye = team.robots, np.eye(team.robots)
    mixing = eye - weight * team.laplacian
    cost, projection = np.zeros((n, n)), np.eye(n)
    cost[leader, leader] = step * CURVATURE
    projection[held, held] = 0.0
    z = np.hstack([eye, mixing @ (2.0 * eye - cost) - eye, mixing @ (cost - eye)])
    before = np.hstack([np.zeros((n, n)), eye, np.zeros((n, n))])
    values, vectors = np.linalg.eig(np.vstack([z, projection @ z, before]))
    moving = (np.abs(values) < 1.0 - AGREEMENT) & (np.abs(vectors[n + leader]) > SHOWN)
    return float(np.abs(values[moving]).max())
