"""The paper's passivity-based distributed optimization (eqs. 25-30): PI consensus, gradient descent, dual ascent.

One explicit step of its equations is one communication round: every robot sends (z_i, zeta_i) to its neighbours once
and then updates its own estimate from what it heard and what it alone knows.

z_i = (m, z_p1, ..., z_pn, z_xi1, ..., z_xin) in R^(4n + 2) is robot i's estimate of the whole network's optimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.problem import Problem
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
    return Estimates(*rounds_of(*round_arguments(problem, estimates, flow), rounds))


def round_arguments(problem: Problem, estimates: Estimates, flow: Flow) -> tuple[tuple, tuple, tuple, tuple, tuple]:
    """Return the first five arguments of `rounds_of`."""
    net, rows = problem.network, problem.rows
    return (
        (estimates.z, estimates.zeta, estimates.lam, estimates.nu),
        (net.first, net.neighbours, net.leader),
        (problem.p, problem.xi, problem.reference),
        (rows.a, rows.C, rows.d, rows.active),
        (flow.alpha, flow.step, flow.multiplier_cap),
    )


@kernel
def rounds_of(estimates, network, state, rows, gains, rounds):  # pragma: no cover - compiled
    """Return the arrays of the estimates after so many rounds, all of them new."""
    old = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    new = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    first, neighbours, leader = network
    p, xi, r = state
    a, C, d, active = rows
    row_first, there = active_rows(active)
    for _ in range(rounds):
        for i in range(len(leader)):
            heard = (neighbours[first[i] : first[i + 1]], old[0], old[1])
            own_rows = there[row_first[i] : row_first[i + 1]]
            own = (i, leader[i], p[i], xi[i], a[i], C[i], d[i], own_rows)
            update_robot(old, new, heard, own, r, gains)
        old, new = new, old
    return old


@kernel
def active_rows(active):  # pragma: no cover - compiled
    """Return the rows that exist, robot after robot: those of robot i are `there[first[i]:first[i + 1]]`."""
    first = np.zeros(len(active) + 1, dtype=np.int64)
    there = np.empty(active.size, dtype=np.int64)
    for i in range(len(active)):
        first[i + 1] = first[i]
        for row in range(active.shape[1]):
            if active[i, row]:
                there[first[i + 1]] = row
                first[i + 1] += 1
    return first, there


@kernel
def update_robot(old, new, heard, own, r, gains):  # pragma: no cover - compiled
    """Write robot i's row of `new` from its own row of `old` and what it heard: rows `at` of `seen_z`, `seen_zeta`."""
    i, delta, p, xi, a, C, d, rows = own
    alpha, step, cap = gains
    z_i, lam_i, nu_i = old[0][i], old[2][i], old[3][i]
    z, zeta, lam, nu = new[0][i], new[1][i], new[2][i], new[3][i]
    n = (len(z) - 2) // 4

    rho, off_x, off_y = _ball(z_i)
    pull = 0.0  # sum of a lambda: the weight of grad rho
    push_x = push_y = 0.0  # sum of C lambda
    lam[:] = 0.0
    for row in rows:
        pull += a[row] * lam_i[row]
        push_x += C[row, 0] * lam_i[row]
        push_y += C[row, 1] * lam_i[row]
        g = a[row] * rho + C[row, 0] * z_i[0] + C[row, 1] * z_i[1] - d[row]  # eq. 13
        # eq. 29: the switch; the clip ends the last explicit step at lambda = 0, where the flow would stop
        switched = lam_i[row] > 0.0 or g > 0.0
        lam[row] = min(max(lam_i[row] + step * g, 0.0), cap) if switched else 0.0
    weight = pull / rho if rho > 0.0 else 0.0  # 0 is a subgradient of rho at its kink

    _consensus(old, (z, zeta), heard, i, step)  # eq. 25 but for the gradient
    pulled = step * alpha * weight
    z[0] -= step * alpha * (2.0 * delta * (z_i[0] - r[0]) + push_x) + pulled * off_x  # grad f_i + grad g_i' lambda_i
    z[1] -= step * alpha * (2.0 * delta * (z_i[1] - r[1]) + push_y) + pulled * off_y
    if pulled > 0.0:
        for c in range(2, 2 + 2 * n, 2):
            z[c] += pulled * (z_i[0] - z_i[c])
            z[c + 1] += pulled * (z_i[1] - z_i[c + 1])
        for c in range(2 + 2 * n, len(z)):
            z[c] -= pulled * z_i[c]
    for axis in range(2):  # grad h_i' nu_i acts on robot i's own blocks; eq. 30
        at_p, at_xi = 2 + 2 * i + axis, 2 + 2 * n + 2 * i + axis
        z[at_p] -= step * alpha * nu_i[axis]
        z[at_xi] -= step * alpha * nu_i[2 + axis]
        nu[axis] = nu_i[axis] + step * (z_i[at_p] - p[axis])
        nu[2 + axis] = nu_i[2 + axis] + step * (z_i[at_xi] - xi[axis])


@kernel
def _consensus(old, out, heard, i, step):  # pragma: no cover - compiled
    """Write z_i - step (sum_k L_ik z_k - sum_k L_ik zeta_k) and zeta_i - step sum_k L_ik z_k; its loops vectorise."""
    at, seen_z, seen_zeta = heard
    z_i, zeta_i = old[0][i], old[1][i]
    z, zeta = out
    z[:] = 0.0
    zeta[:] = 0.0
    for k in at:
        z_k, zeta_k = seen_z[k], seen_zeta[k]
        for c in range(len(z)):
            zeta[c] += z_i[c] - z_k[c]
            z[c] += zeta_i[c] - zeta_k[c]
    for c in range(len(z)):
        lead, lead_zeta = zeta[c], z[c]
        z[c] = z_i[c] - step * (lead - lead_zeta)
        zeta[c] = zeta_i[c] - step * lead


@kernel
def _ball(z):  # pragma: no cover - compiled
    """Return rho(m, z_p, z_xi) of one robot's estimate, and sum_j (m - z_pj)."""
    n = (len(z) - 2) // 4
    square_x = square_y = square_xi = square_eta = 0.0  # four sums that need not wait for each other
    off_x = off_y = 0.0
    for c in range(2, 2 + 2 * n, 2):
        x, y = z[0] - z[c], z[1] - z[c + 1]
        square_x += x * x
        square_y += y * y
        off_x += x
        off_y += y
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        square_xi += z[c] * z[c]
        square_eta += z[c + 1] * z[c + 1]
    return math.sqrt(square_x + square_y + square_xi + square_eta), off_x, off_y
