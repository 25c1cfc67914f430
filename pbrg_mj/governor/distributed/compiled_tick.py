"""A tick of the distributed governor, in which every message arrives within its round, in one compiled call.

Between two ticks of physics the processor's caches are cold, and calls from Python count: docs/performance.md says what
limits the loop.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.infeasibility import some_row_is_infeasible
from pbrg_mj.governor.distributed.rounds import check_limits, write_rounds
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.near_reference import write_near_references
from pbrg_mj.kernel import kernel


class EstimateChecks(NamedTuple):
    """What estimates say of themselves."""

    bounded: bool  # they are finite, and z is within the limit
    capped: bool  # some multiplier is at its cap
    suspected: bool  # some robot has a row that no m meets by its estimates


def run_tick(
    problem: Problem, estimates: Estimates, flow: Flow, rounds: int, limit: float
) -> tuple[Estimates, EstimateChecks]:
    """Return the estimates after so many rounds, and what they say of themselves; z is allowed up to `limit` [m]."""
    z, lam, nu = estimates.z.shape, estimates.lam.shape, estimates.nu.shape
    after = (np.empty(z), np.empty(z), np.zeros(lam), np.empty(nu))
    states = (problem.p, problem.xi, problem.reference, problem.reference_range)
    given = tuple(estimates), problem.network.arrays, states, tuple(problem.rows), tuple(flow)
    return Estimates(*after), EstimateChecks(*write_tick(*given, rounds, limit, after))


@kernel
def write_tick(estimates, graph, states, rows, flow, rounds, limit, after):
    """Write the estimates after so many rounds, and return `EstimateChecks`; arguments are those of `write_rounds`.

    But for `states`: p, xi (n, 2), the operator's r (2,) and its reach, how far away it may pull [m]. `estimates` and
    `after` (four arrays, in this order) are z, zeta, lam, nu of `Estimates`, `rows` a, C, d, active, along of `Rows`,
    `flow` (numbers, in their order) the members of `Flow`.
    """
    p, xi, r, reach = states
    near = np.empty(p.shape)
    write_near_references(p, r, reach, near)
    write_rounds(estimates, graph, (p, xi, near), rows, flow, rounds, after)
    bounded, capped = check_limits(after[0], after[2], limit, flow[2])
    a, C, d, active, along = rows
    return bounded, capped, some_row_is_infeasible(after[0], a, C, d, active, along)
