"""From what the half-spaces allow to the next reference: towards r as far as half-spaces, motors and beams allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from pbrg_mj.governor.certificate.projection import least_violating, near_allowed, nearest_allowed, search_radius
from pbrg_mj.governor.problem.interface import Problem, Status
from pbrg_mj.governor.problem.near_reference import near_point


class AdvanceLimit(Protocol):
    """What stops advances and never asks for a retreat."""

    def kappa(self, error: np.ndarray, heading: np.ndarray, advance: np.ndarray) -> float:
        """Return the largest kappa in [0, 1] of which kappa * advance (2,) [m] may be added to m.

        `error` (N, 2) [m] is (p, xi) - (m, 0) at the held m, `heading` (n,) [rad].
        """
        ...


def next_reference(
    problem: Problem, held: np.ndarray, limits: Sequence[AdvanceLimit], reach: float, farthest: float = math.inf
) -> tuple[np.ndarray, Status]:
    """Return the next m (2,) [m], and its status. The problem's rows are linear in m.

    Where the held m (2,) is admissible, m goes towards the admissible point nearest to r as far as the limits allow. An
    r farther than `farthest` [m] from the mean of p is taken as the point so far on the way to it.
    Where it is not, it first goes to the admissible point nearest to where it is held, whatever the limits say. Where
    rows contradict each other, so that none is admissible near the mean of p (within `reach` [m], and what
    `search_radius` says), it goes towards the point near there that violates the worst row least, as far as the limits
    allow: what no m keeps, no leap of m saves, and rows that noise turned are others a scan later.
    """
    rows, (p, xi) = problem.rows, problem.prediction_state
    normals = rows.C[rows.active]
    offsets = rows.d[rows.active] - (normals[:, 0] * held[0] + normals[:, 1] * held[1])
    centre = p.mean(axis=0)
    aim = np.array(near_point(*centre, *problem.reference, farthest)) - held
    found, x, y = nearest_allowed(aim[0], aim[1], normals, offsets, 0.0)
    goal, retreat = np.array([x, y]), np.zeros(2)
    status: Status = "ok"
    shift = centre - held
    beyond = offsets - (normals[:, 0] * shift[0] + normals[:, 1] * shift[1])  # as seen from the team
    if not (found and near_allowed(normals, offsets, beyond, reach)):
        goal = shift + np.array(least_violating(normals, beyond, search_radius(beyond, reach)))
        status = "inadmissible" if found else "infeasible"
    else:
        _, x, y = nearest_allowed(0.0, 0.0, normals, offsets, 0.0)  # 0 where the held m is admissible
        retreat = np.array([x, y])
    if not limits or problem.heading is None:
        return held + goal, status
    error = np.concatenate([p - held - retreat, xi])
    advance = goal - retreat
    return held + retreat + min(one.kappa(error, problem.heading, advance) for one in limits) * advance, status
