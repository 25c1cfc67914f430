"""The paper's passivity-based distributed optimization (eqs. 25-30): PI consensus, gradient descent, dual ascent.

One explicit step of its equations is one communication round: every robot sends (z_i, zeta_i) to its neighbours once
and then updates its own estimate from what it heard and what it alone knows.

z_i = (m, z_p1, ..., z_pn, z_xi1, ..., z_xin) in R^(4n + 2) is robot i's estimate of the whole network's optimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel


@dataclass(frozen=True)
class Flow:
    """Parameters of the flow that every robot integrates.

    With a finite `multiplier_cap` mu the network minimizes f + mu sum max(g, 0), the exact penalty: the same optimum
    while every optimal multiplier is below mu, and the least violation instead of runaway when nothing is admissible.
    """

    alpha: float  # gain
    step: float  # of one round [s]
    multiplier_cap: float = math.inf


@dataclass(frozen=True)
class Estimates:
    """What the robots remember between rounds; row i is robot i's own."""

    z: np.ndarray  # (n, 4n + 2)
    zeta: np.ndarray  # (n, 4n + 2) integral states of the PI consensus
    lam: np.ndarray  # (n, R) multipliers of g_i <= 0
    nu: np.ndarray  # (n, 4) multipliers of h_i = (z_pi - p_i, z_xii - xi_i) = 0


def run_rounds(problem: Problem, estimates: Estimates, flow: Flow, rounds: int) -> Estimates:
    """Return the estimates after `rounds` communication rounds."""
    z, lam, nu = estimates.z.shape, estimates.lam.shape, estimates.nu.shape
    after = (np.empty(z), np.empty(z), np.zeros(lam), np.empty(nu))  # numpy makes them faster than compiled code does
    write_rounds(*round_arguments(problem, estimates, flow), rounds, after)
    return Estimates(*after)


def round_arguments(problem: Problem, estimates: Estimates, flow: Flow) -> tuple[tuple, tuple, tuple, tuple, tuple]:
    """Return the first five arguments of `rounds_in_new_arrays` and `write_rounds`."""
    net, rows = problem.network, problem.rows
    return (
        (estimates.z, estimates.zeta, estimates.lam, estimates.nu),
        (net.first, net.neighbours, net.leader),
        (problem.p, problem.xi, problem.reference),
        (rows.a, rows.C, rows.d, rows.active),
        (flow.alpha, flow.step, flow.multiplier_cap),
    )


@kernel
def rounds_in_new_arrays(estimates, network, state, rows, gains, rounds):  # pragma: no cover - compiled
    """Return the arrays of the estimates after so many rounds, all of them new."""
    after = empty_estimates(estimates)
    write_rounds(estimates, network, state, rows, gains, rounds, after)
    return after


@kernel
def write_rounds(estimates, network, state, rows, gains, rounds, after):  # pragma: no cover - compiled
    """Write the estimates after so many rounds to `after`, arrays like those of `empty_estimates`."""
    first, neighbours, leader = network
    own, other, now = (leader, state, rows, active_rows(rows[3])), empty_estimates(estimates), estimates
    for left in range(rounds, 0, -1):
        then = after if left % 2 == 1 else other  # so that the last round writes what is asked for
        update_robots(now, then, (first, neighbours, now[0], now[1]), own, gains)
        now = then
    if rounds == 0:
        after[0][:], after[1][:], after[2][:], after[3][:] = now


@kernel
def empty_estimates(estimates):  # pragma: no cover - compiled
    """Return new estimates for `update_robots` to write."""
    z, zeta, lam, nu = estimates
    return np.empty(z.shape), np.empty(zeta.shape), np.zeros(lam.shape), np.empty(nu.shape)


@kernel
def active_rows(active):  # pragma: no cover - compiled
    """Return the rows that exist, robot after robot: those of robot i are `which[first[i]:first[i + 1]]`."""
    first = np.zeros(len(active) + 1, dtype=np.int64)
    which = np.empty(active.size, dtype=np.int64)
    for i in range(len(active)):
        first[i + 1] = first[i]
        for row in range(active.shape[1]):
            if active[i, row]:
                which[first[i + 1]] = row
                first[i + 1] += 1
    return first, which


@kernel
def update_robots(old, new, heard, own, gains):  # pragma: no cover - compiled
    """Write every robot's row of `new` from its own row of `old`, from what it heard and from what it alone knows.

    `new` lambda has zeros where there are no rows: they are not written again and again, for most slots are empty.
    heard = (first, at, seen_z, seen_zeta): robot i heard the rows at[first[i]:first[i + 1]] of seen_z and seen_zeta.
    The parts take whole arrays and index them: a view of one robot's row is a reference that numba counts, up and down,
    by atomic instructions; forty of them for each robot would be most of a small team's round.
    """
    leader, (p, xi, r), (a, C, d, _), there = own
    _consensus(old, new, heard, gains[1])
    _descend(old, new, (leader, r), (a, C, d, there), gains)
    _pin_states(old, new, (p, xi), gains)


@kernel
def _consensus(old, new, heard, step):  # pragma: no cover - compiled
    """Write z_i - step (sum_k L_ik z_k - sum_k L_ik zeta_k) and zeta_i - step sum_k L_ik z_k; its loops vectorise."""
    z, zeta, new_z, new_zeta = old[0], old[1], new[0], new[1]
    first, at, seen_z, seen_zeta = heard
    n, width = z.shape
    for i in range(n):
        if first[i + 1] - first[i] == 2:  # as on a ring: both sums at once, every number is read and written once
            k, j = at[first[i]], at[first[i] + 1]
            for c in range(width):
                lead = (z[i, c] - seen_z[k, c]) + (z[i, c] - seen_z[j, c])
                lead_zeta = (zeta[i, c] - seen_zeta[k, c]) + (zeta[i, c] - seen_zeta[j, c])
                new_z[i, c] = z[i, c] - step * (lead - lead_zeta)
                new_zeta[i, c] = zeta[i, c] - step * lead
            continue
        for c in range(width):
            new_z[i, c] = new_zeta[i, c] = 0.0
        for e in range(first[i], first[i + 1]):
            k = at[e]
            for c in range(width):
                new_zeta[i, c] += z[i, c] - seen_z[k, c]
                new_z[i, c] += zeta[i, c] - seen_zeta[k, c]
        for c in range(width):
            lead, lead_zeta = new_zeta[i, c], new_z[i, c]
            new_z[i, c] = z[i, c] - step * (lead - lead_zeta)
            new_zeta[i, c] = zeta[i, c] - step * lead


@kernel
def _descend(old, new, goal, rows, gains):  # pragma: no cover - compiled
    """Take step alpha (grad f_i + grad g_i' lambda_i) from new z_i (eq. 25); write new lambda_i (eq. 29)."""
    z, lam, new_z, new_lam = old[0], old[2], new[0], new[2]
    leader, r = goal
    a, C, d, (first, there) = rows
    alpha, step, cap = gains
    n = len(leader)
    for i in range(n):
        rho = off_x = off_y = 0.0  # nobody asks for them where there are no rows
        if first[i] < first[i + 1]:
            rho, off_x, off_y = _radius(z, i)
        pull = 0.0  # sum of a lambda: the weight of grad rho
        push_x = push_y = 0.0  # sum of C lambda
        for e in range(first[i], first[i + 1]):
            row = there[e]
            multiplier = lam[i, row]
            pull += a[i, row] * multiplier
            push_x += C[i, row, 0] * multiplier
            push_y += C[i, row, 1] * multiplier
            g = a[i, row] * rho + C[i, row, 0] * z[i, 0] + C[i, row, 1] * z[i, 1] - d[i, row]  # eq. 13
            # eq. 29: the switch; the clip ends the last explicit step at lambda = 0, where the flow would stop
            switched = multiplier > 0.0 or g > 0.0
            new_lam[i, row] = min(max(multiplier + step * g, 0.0), cap) if switched else 0.0
        weight = pull / rho if rho > 0.0 else 0.0  # 0 is a subgradient of rho at its kink
        pulled = step * alpha * weight
        new_z[i, 0] -= step * alpha * (2.0 * leader[i] * (z[i, 0] - r[0]) + push_x) + pulled * off_x
        new_z[i, 1] -= step * alpha * (2.0 * leader[i] * (z[i, 1] - r[1]) + push_y) + pulled * off_y
        if pulled > 0.0:
            for c in range(2, 2 + 2 * n, 2):
                new_z[i, c] += pulled * (z[i, 0] - z[i, c])
                new_z[i, c + 1] += pulled * (z[i, 1] - z[i, c + 1])
            for c in range(2 + 2 * n, 2 + 4 * n):
                new_z[i, c] -= pulled * z[i, c]


@kernel
def _pin_states(old, new, state, gains):  # pragma: no cover - compiled
    """Take step alpha grad h_i' nu_i from new z_i, of which it moves robot i's own blocks; write new nu_i (eq. 30)."""
    z, nu, new_z, new_nu = old[0], old[3], new[0], new[3]
    p, xi = state
    alpha, step, _ = gains
    n = len(p)
    for i in range(n):
        for axis in range(2):
            at_p, at_xi = 2 + 2 * i + axis, 2 + 2 * n + 2 * i + axis
            new_z[i, at_p] -= step * alpha * nu[i, axis]
            new_z[i, at_xi] -= step * alpha * nu[i, 2 + axis]
            new_nu[i, axis] = nu[i, axis] + step * (z[i, at_p] - p[i, axis])
            new_nu[i, 2 + axis] = nu[i, 2 + axis] + step * (z[i, at_xi] - xi[i, axis])


@kernel
def _radius(z, i):  # pragma: no cover - compiled
    """Return rho(m, z_p, z_xi) of robot i's estimate, and sum_j (m - z_pj)."""
    n = len(z)
    square_x = square_y = square_xi = square_eta = 0.0  # four sums that need not wait for each other
    off_x = off_y = 0.0
    for c in range(2, 2 + 2 * n, 2):
        x, y = z[i, 0] - z[i, c], z[i, 1] - z[i, c + 1]
        square_x += x * x
        square_y += y * y
        off_x += x
        off_y += y
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        square_xi += z[i, c] * z[i, c]
        square_eta += z[i, c + 1] * z[i, c + 1]
    return math.sqrt(square_x + square_y + square_xi + square_eta), off_x, off_y


@kernel
def check_limits(z, lam, limit, cap):  # pragma: no cover - compiled
    """Return whether estimates z and lambda are finite and z within `limit`, and whether some lambda is at `cap`."""
    bounded, capped = True, False
    for value in z.flat:
        bounded &= math.isfinite(value) and abs(value) <= limit
    for value in lam.flat:
        bounded &= math.isfinite(value)
        capped |= value >= cap
    return bounded, capped
