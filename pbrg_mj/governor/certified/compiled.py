"""The certified decision of a tick for the team at once, compiled: what `decide.next_reference` does of the rows.

Between two ticks of physics every call of NumPy costs microseconds, so rows are not laid out here: half-planes are made
from the advances of a certificate as they are needed, number by number as `certificate.advances` and `decide` do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.advances import AdvanceCertificate
from pbrg_mj.governor.certificate.prediction_grid import write_error
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate, write_advances
from pbrg_mj.governor.certificate.projection import least_violating, near_allowed, nearest_allowed, search_radius
from pbrg_mj.governor.certificate.sight import SightLimit, sight_kappa
from pbrg_mj.governor.certificate.speed import SpeedLimit, speed_kappa
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.governor.problem.interface import Problem, Status
from pbrg_mj.governor.problem.near_reference import near_point
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces

NO_SPEED_ROWS = np.zeros(0), np.zeros((0, 0, 0)), np.zeros((0, 0)), np.zeros((0, 2)), 1.0, np.zeros((0, 2))
"""`SpeedLimit.rows` that limit nothing."""
NO_SIGHT_ROWS = np.zeros((0, 0, 0)), np.zeros((0, 1)), np.zeros(0, dtype=np.int64), 1.0
"""`SightLimit.rows` that limit nothing."""
STATUSES: tuple[Status, ...] = ("ok", "inadmissible", "infeasible")  # by number; from 1 on they are FORBIDDEN


class Decision(NamedTuple):
    """What a tick's half-spaces allow."""

    m: np.ndarray  # (n, 2) the next reference, the same for all robots [m]
    status: Status
    intervals: int  # half-spaces that ask for something


@dataclass(frozen=True)
class CompiledDecision:
    """A certificate and the limits of advances, as arrays."""

    certificate: AdvanceCertificate
    speed: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]  # `SpeedLimit.rows`
    sight: tuple[np.ndarray, np.ndarray, np.ndarray, float]  # `SightLimit.rows`
    limited: bool  # whether there are any limits
    reach: float  # of a retreat [m]
    farthest: float = math.inf  # that r may be from the mean of p [m]

    @classmethod
    def of(
        cls,
        certificate: AdvanceCertificate,
        limits: Sequence[AdvanceLimit],
        reach: float,
        farthest: float = math.inf,
    ) -> CompiledDecision:
        """Return the decision by a certificate and limits, one of each kind at most."""
        speed = [one.rows for one in limits if isinstance(one, SpeedLimit)]
        sight = [one.rows for one in limits if isinstance(one, SightLimit)]
        if len(speed) > 1 or len(sight) > 1 or len(speed) + len(sight) < len(limits):
            raise ValueError("other limits than one of speed and one of sight are not compiled")
        rows = (speed or [NO_SPEED_ROWS])[0], (sight or [NO_SIGHT_ROWS])[0]
        return cls(certificate, *rows, bool(limits), reach, farthest)

    def next_reference(self, problem: Problem, held: np.ndarray) -> Decision:
        """Return what `decide.next_reference` does with the certificate's rows at the held m (2,)."""
        spaces, heading = problem.half_spaces, problem.heading
        if spaces is None or heading is None:
            raise ValueError("the certified governor needs half-spaces and headings in the problem")
        return self.decide(spaces, (*problem.prediction_state, heading), held, problem.reference)

    def decide(
        self, spaces: HalfSpaces, state: tuple[np.ndarray, ...], held: np.ndarray, reference: np.ndarray
    ) -> Decision:
        """Return the same from half-spaces, p (n, 2), xi (N - n, 2) of the prediction's state, and headings."""
        p, xi, heading = state
        rows, m, given = self.certificate, np.empty(p.shape), (p, xi, heading, held, reference)
        if isinstance(rows, PredictiveCertificate):
            arrays = (spaces.G, spaces.h, spaces.active, spaces.binds)
            return _decision(m, write_predicted_next(arrays, given, rows.packed, self.limits, m))
        allowed = rows.advances(spaces, p, xi, held)
        return _decision(m, write_next((spaces.G, spaces.active), tuple(allowed), given, self.limits, m))

    @cached_property
    def limits(self) -> tuple[Any, ...]:
        """What the kernels take: the rows of both limits, whether there are any, and both distances."""
        return self.speed, self.sight, self.limited, self.reach, self.farthest


def _decision(m: np.ndarray, result: tuple[int, int]) -> Decision:
    return Decision(m, STATUSES[result[0]], result[1])


@kernel
def write_predicted_next(half_spaces, state, certificate, limits, m):
    """Do `write_next` by the advances of a predictive certificate, in one call.

    `half_spaces` are G, h, active and binds of HalfSpaces; `state` is p, xi, heading, held and r as for `write_next`;
    `certificate` is `PredictiveCertificate.packed`: grid_rows and team as for `write_advances`.
    """
    G, h, active, _ = half_spaces
    p, xi, _, held, _ = state
    grid_rows, team = certificate
    allowed = (np.empty(h.shape), np.empty(h.shape))
    write_advances(half_spaces, (p, xi, held), grid_rows, team, allowed)
    return write_next((G, active), allowed, state, limits, m)


@kernel
def write_next(half_spaces, allowed, state, limits, m):
    """Write m (n, 2); return its status by number in `STATUSES`, and how many half-spaces ask for something.

    `half_spaces` are G and active of HalfSpaces, `allowed` low and high of Advances; `state` p (n, 2), xi
    (N - n, 2) [m], heading (n,) [rad], the m that is held (2,) [m], the operator's reference (2,) [m]; `limits` are
    those of CompiledDecision: speed as for `speed_kappa`, sight as for `sight_kappa`, whether m is limited at all,
    reach and farthest.
    """
    p, xi, heading, held, reference = state
    speed, sight, limited, reach, farthest = limits
    G, active = half_spaces
    normals, offsets = np.empty((2 * active.size, 2)), np.empty(2 * active.size)
    count, intervals = _write_half_planes(G, active, allowed, held, normals, offsets)
    normals, offsets = normals[:count], offsets[:count]
    centre_x, centre_y = _mean(p)
    aim_x, aim_y = near_point(centre_x, centre_y, reference[0], reference[1], farthest)
    found, x, y = nearest_allowed(aim_x - held[0], aim_y - held[1], normals, offsets, 0.0)
    shift_x, shift_y, beyond = centre_x - held[0], centre_y - held[1], np.empty(count)  # as seen from the team
    for k in range(count):
        beyond[k] = offsets[k] - (normals[k, 0] * shift_x + normals[k, 1] * shift_y)
    status, back_x, back_y = 0, 0.0, 0.0
    if not (found and near_allowed(normals, offsets, beyond, reach)):
        status = 1 if found else 2
        x, y = least_violating(normals, beyond, search_radius(beyond, reach))
        x, y = shift_x + x, shift_y + y
    elif limited:
        _, back_x, back_y = nearest_allowed(0.0, 0.0, normals, offsets, 0.0)  # 0 where the held m is admissible
    if limited:
        error, advance = np.empty((len(p) + len(xi), 2)), np.empty(2)
        write_error(p, xi, held, error)
        for j in range(len(p)):
            error[j, 0], error[j, 1] = error[j, 0] - back_x, error[j, 1] - back_y
        advance[0], advance[1] = x - back_x, y - back_y
        kappa = min(speed_kappa(speed, error, heading, advance), sight_kappa(sight, error, advance))
        x, y = held[0] + back_x + kappa * advance[0], held[1] + back_y + kappa * advance[1]
    else:
        x, y = held[0] + x, held[1] + y
    for j in range(len(m)):
        m[j, 0], m[j, 1] = x, y
    return status, intervals


@kernel
def _mean(p):
    """Return the mean of p (n, 2), added in order as NumPy does."""
    x = y = 0.0
    for j in range(len(p)):
        x, y = x + p[j, 0], y + p[j, 1]
    return x / len(p), y / len(p)


@kernel
def _write_half_planes(G, active, allowed, held, normals, offsets):
    """Write the half-planes of all advances as seen from the held m; return how many, and of how many half-spaces.

    At most two for each half-space: normals (2nK, 2), offsets (2nK,) [m].
    """
    low, high = allowed
    count = intervals = 0
    for i in range(active.shape[0]):
        for k in range(active.shape[1]):
            at, before = G[i, k, 0] * held[0] + G[i, k, 1] * held[1], count
            for sign, limit in ((1.0, at + high[i, k]), (-1.0, -(at + low[i, k]))):
                if active[i, k] and math.isfinite(limit):
                    normals[count, 0], normals[count, 1] = sign * G[i, k, 0], sign * G[i, k, 1]
                    offsets[count] = limit - (normals[count, 0] * held[0] + normals[count, 1] * held[1])
                    count += 1
            intervals += count > before
    return count, intervals
