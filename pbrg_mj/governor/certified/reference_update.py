"""The update of the reference in the last tick of a cycle: m + kappa (candidate - m), or a retreat, or none.

kappa is the smallest that any robot has verified.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.nearest import nearest_retreat
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.governor.optimizers.interface import no_rows
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.network import Network

NO_ROWS = no_rows()


class PredictedTeam(NamedTuple):
    """The team in a cycle's last tick, as every robot predicts it that knows all states of its first."""

    p: np.ndarray  # (n, 2) [m]
    xi: np.ndarray  # (n, 2) [m]
    heading: np.ndarray  # (n,) of the bodies in the first tick [rad]
    held: np.ndarray  # (2,) m till then [m]; first the mean of p
    candidate: np.ndarray  # (2,) [m]
    rows_requested: bool  # some robot asks for the rows of all
    diverged: bool = False  # the optimizer's iterates have left all bounds; the candidate is the held m


def reference_update(
    predicted: PredictedTeam,
    kappa: float,
    rows: Rows | None,
    limits: tuple[AdvanceLimit, ...],
    reference: np.ndarray | None = None,
    reach: float = math.inf,
) -> tuple[np.ndarray, Status]:
    """Return the next m (2,) [m], and how it came about.

    `rows` are those of all robots where some robot's forbid the held m, None while they are still to come, and without
    one, `NO_ROWS`, where none do. `reference` (2,) is the r of an only leader: where the held m is allowed the optimum
    is no farther from r than it, so a candidate that is farther is an optimizer's that has not converged, and waits.
    A retreat ends within `reach` [m] of the mean of p; where rows contradict each other m goes towards it as far as the
    limits allow, as in `decide.next_reference`.
    """
    held, status = predicted.held, optimizer_status(predicted)
    if rows is None:
        return held, "inadmissible"
    if rows.d.size:
        goal, retreat_status = nearest_retreat(rows, Spread.of(predicted.p, predicted.xi), held, reach)
        if retreat_status == "ok":
            return goal, status
        advance, status = goal - held, retreat_status
    elif reference is not None and _distance(predicted.candidate, reference) > _distance(held, reference):
        return held, status
    else:
        advance = kappa * (predicted.candidate - held)
    error = np.vstack([predicted.p - held, predicted.xi])
    allowed = min((limit.kappa(error, predicted.heading, advance) for limit in limits), default=1.0)
    return held + allowed * advance, status


def optimizer_status(predicted: PredictedTeam) -> Status:
    """Return `diverged` where the optimizer has, else `ok`: the status of a tick in which no row stands in the way."""
    return "diverged" if predicted.diverged else "ok"


def single_leader_reference(network: Network, reference: np.ndarray | None) -> np.ndarray | None:
    """Return the `reference` (2,) of a leader if no other leader aims at one, None else."""
    return reference if np.count_nonzero(network.leader) == 1 else None


def _distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return how far two points (2,) are apart [m]."""
    return math.hypot(*(one - other).tolist())
