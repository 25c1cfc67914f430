"""Communication rounds, compiled: what `equations` specifies, for all robots at once.

Kernels that Python calls take plain tuples in the order of the named tuples' fields, for to find a named tuple's type
costs more than a round; inside, everything has its name.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.descent import descend, descend_along
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.proximal import descend_proximally
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel
from pbrg_mj.team.network import GraphArrays


class ReceivedStates(NamedTuple):
    """What robots received in one round: robot i the rows which[first[i]:first[i + 1]] of z and zeta."""

    first: np.ndarray  # (n + 1,) int64
    which: np.ndarray  # int64
    z: np.ndarray  # (robots or links, 4n + 2)
    zeta: np.ndarray  # likewise


class PrivateData(NamedTuple):
    """What robots alone know; row i is robot i's own, and its constraints that exist are row[first[i]:first[i + 1]]."""

    leader: np.ndarray  # (n,) delta
    p: np.ndarray  # (n, 2) [m]
    xi: np.ndarray  # (n, 2) [m]
    reference: np.ndarray  # (n, 2) the operator's as each would take it, received by the leaders [m]
    a: np.ndarray  # (n, R)
    C: np.ndarray  # (n, R, 2)
    d: np.ndarray  # (n, R) [m]
    along: np.ndarray  # (n, R, 2), or (0, 0, 2) where rows have no directions
    first: np.ndarray  # (n + 1,) int64
    row: np.ndarray  # int64


def run_rounds(problem: Problem, estimates: Estimates, flow: Flow, rounds: int) -> Estimates:
    """Return the estimates after `rounds` communication rounds in which every message arrives."""
    z, lam, nu = estimates.z.shape, estimates.lam.shape, estimates.nu.shape
    after = (np.empty(z), np.empty(z), np.zeros(lam), np.empty(nu))  # numpy makes them faster than compiled code does
    write_rounds(*round_arguments(problem, estimates, flow), rounds, after)
    return Estimates(*after)


def round_arguments(problem: Problem, estimates: Estimates, flow: Flow) -> tuple[tuple, tuple, tuple, tuple, tuple]:
    """Return the first five arguments of `rounds_in_new_arrays` and `write_rounds`."""
    states = (problem.p, problem.xi, problem.near_references)
    return tuple(estimates), problem.network.arrays, states, tuple(problem.rows), tuple(flow)


@kernel
def rounds_in_new_arrays(estimates, graph, states, rows, flow, rounds):
    """Return z, zeta, lam, nu after so many rounds, all of them new; arguments are those of `write_rounds`."""
    after = empty_estimates(estimates)
    write_rounds(estimates, graph, states, rows, flow, rounds, after)
    return after


@kernel
def write_rounds(estimates, graph, states, rows, flow, rounds, after):
    """Write the estimates after so many rounds.

    `estimates` and `after` are z, zeta, lam, nu of `Estimates`, those before are kept, lam of those after is all 0;
    `graph` first, neighbours, leader of `GraphArrays`; `states` p, xi, reference, each (n, 2); `rows` a, C, d,
    active, along of `Rows`; `flow` the members of `Flow`.
    """
    net, gains, private = GraphArrays(*graph), Flow(*flow), private_data(graph, states, rows)
    now, last, other = Estimates(*estimates), Estimates(*after), Estimates(*empty_estimates(estimates))
    for left in range(rounds, 0, -1):
        then = last if left % 2 == 1 else other  # so that the last round writes what is asked for
        update_robots(now, then, ReceivedStates(net.first, net.neighbours, now.z, now.zeta), private, gains)
        now = then
    if rounds == 0:
        _copy(now.z, last.z)
        _copy(now.zeta, last.zeta)
        _copy(now.lam, last.lam)
        _copy(now.nu, last.nu)


@kernel
def _copy(array, to):
    """Copy `array` (A, B) to `to` (A, B) number by number.

    For whole arrays numba compiles a check with a formatted error.
    """
    for i in range(array.shape[0]):
        for c in range(array.shape[1]):
            to[i, c] = array[i, c]


@kernel
def empty_estimates(estimates):
    """Return new arrays like z, zeta, lam, nu for `update_robots` to write."""
    z, zeta, lam, nu = estimates
    return np.empty(z.shape), np.empty(zeta.shape), np.zeros(lam.shape), np.empty(nu.shape)


@kernel
def private_data(graph, states, rows):
    """Return `PrivateData` of plain tuples as `write_rounds` takes them.

    `states` are p, xi and reference, each (n, 2) [m].
    """
    (p, xi, reference), own = states, Rows(*rows)
    first = np.zeros(len(own.active) + 1, dtype=np.int64)
    existing = np.empty(own.active.size, dtype=np.int64)
    for i in range(len(own.active)):
        first[i + 1] = first[i]
        for row in range(own.active.shape[1]):
            if own.active[i, row]:
                existing[first[i + 1]] = row
                first[i + 1] += 1
    return PrivateData(GraphArrays(*graph).leader, p, xi, reference, own.a, own.C, own.d, own.along, first, existing)


@kernel
def update_robots(old, new, received, private, flow):
    """Write every robot's row of `new` from its own row of `old`, from what it received and from what it alone knows.

    Arguments: `Estimates` twice, `ReceivedStates`, `PrivateData`, `Flow`. `new.lam` has zeros where there are no rows:
    they are not written again and again, for most slots are empty. The parts take whole arrays and index them. A view
    of one robot's row is a reference that numba counts, up and down, by atomic instructions; forty of them for each
    robot would be most of a small team's round.
    """
    _consensus(old, new, received, flow.step)
    if flow.proximal:
        descend_proximally(old, new, private, flow)
        return
    if len(private.along) > 0:
        descend_along(old, new, private, flow)
    else:
        descend(old, new, private, flow)
    _pin_states(old, new, private, flow)


@kernel
def _consensus(old, new, received, step):
    """Write z_i - step (sum_k L_ik z_k - sum_k L_ik zeta_k) and zeta_i - step sum_k L_ik z_k; its loops vectorise."""
    z, zeta, new_z, new_zeta = old.z, old.zeta, new.z, new.zeta
    first, which, seen_z, seen_zeta = received.first, received.which, received.z, received.zeta
    n, width = z.shape
    for i in range(n):
        if first[i + 1] - first[i] == 2:  # as on a ring: both sums at once, nothing that was written is read again
            k, j = which[first[i]], which[first[i] + 1]
            for c in range(width):  # two loops, for one that writes two arrays waits longer for memory
                lead = (z[i, c] - seen_z[k, c]) + (z[i, c] - seen_z[j, c])
                new_zeta[i, c] = zeta[i, c] - step * lead
            for c in range(width):
                lead = (z[i, c] - seen_z[k, c]) + (z[i, c] - seen_z[j, c])
                lead_zeta = (zeta[i, c] - seen_zeta[k, c]) + (zeta[i, c] - seen_zeta[j, c])
                new_z[i, c] = z[i, c] - step * (lead - lead_zeta)
            continue
        for c in range(width):
            new_z[i, c] = new_zeta[i, c] = 0.0
        for e in range(first[i], first[i + 1]):
            k = which[e]
            for c in range(width):
                new_zeta[i, c] += z[i, c] - seen_z[k, c]
                new_z[i, c] += zeta[i, c] - seen_zeta[k, c]
        for c in range(width):
            lead, lead_zeta = new_zeta[i, c], new_z[i, c]
            new_z[i, c] = z[i, c] - step * (lead - lead_zeta)
            new_zeta[i, c] = zeta[i, c] - step * lead


@kernel
def _pin_states(old, new, private, flow):
    """Take step alpha grad h_i' nu_i from new z_i, of which it moves robot i's own blocks; write new nu_i (eq. 30)."""
    z, nu, new_z, new_nu = old.z, old.nu, new.z, new.nu
    p, xi, alpha, step = private.p, private.xi, flow.alpha, flow.step
    n = len(p)
    for i in range(n):
        for axis in range(2):
            at_p, at_xi = 2 + 2 * i + axis, 2 + 2 * n + 2 * i + axis
            new_z[i, at_p] -= step * alpha * nu[i, axis]
            new_z[i, at_xi] -= step * alpha * nu[i, 2 + axis]
            new_nu[i, axis] = nu[i, axis] + step * (z[i, at_p] - p[i, axis])
            new_nu[i, 2 + axis] = nu[i, 2 + axis] + step * (z[i, at_xi] - xi[i, axis])


@kernel
def check_limits(z, lam, limit, cap):
    """Return whether estimates z and lambda are finite and z within `limit`, and whether some lambda is at `cap`."""
    bounded, capped = True, False
    for value in z.flat:
        bounded &= math.isfinite(value) and abs(value) <= limit
    for value in lam.flat:
        bounded &= math.isfinite(value)
        capped |= value >= cap
    return bounded, capped
