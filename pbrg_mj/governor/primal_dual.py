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
    net, rows = problem.network, problem.rows
    arrays = _rounds(
        (estimates.z, estimates.zeta, estimates.lam, estimates.nu),
        (net.first, net.neighbours, net.leader),
        (problem.p, problem.xi, problem.reference),
        (rows.a, rows.C, rows.d, rows.active),
        (flow.alpha, flow.step, flow.multiplier_cap, rounds),
    )
    return Estimates(*arrays)


@kernel
def _rounds(estimates, network, state, rows, gains):  # pragma: no cover - compiled
    old = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    new = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    first, neighbours, leader = network
    p, xi, r = state
    a, C, d, active = rows
    alpha, step, cap, rounds = gains
    n = len(leader)
    for _ in range(rounds):
        for i in range(n):
            heard = (neighbours[first[i] : first[i + 1]], old[0], old[1])
            own = (i, leader[i], p[i], xi[i], a[i], C[i], d[i], active[i])
            update_robot(old, new, heard, own, r, (alpha, step, cap))
        old, new = new, old
    return old


@kernel
def update_robot(old, new, heard, own, r, gains):  # pragma: no cover - compiled
    """Write robot i's row of `new` from its own row of `old` and what it heard: rows `at` of `seen_z`, `seen_zeta`."""
    z, zeta, lam, nu = old
    at, seen_z, seen_zeta = heard
    i, delta, p, xi, a, C, d, active = own
    alpha, step, cap = gains
    size = z.shape[1]
    n = (size - 2) // 4
    z_i, zeta_i, lam_i, nu_i = z[i], zeta[i], lam[i], nu[i]

    rho = _rho(z_i)
    pull = 0.0  # sum of a lambda: the weight of grad rho
    push_x = push_y = 0.0  # sum of C lambda
    for row in range(len(a)):
        if not active[row]:
            new[2][i, row] = 0.0
            continue
        pull += a[row] * lam_i[row]
        push_x += C[row, 0] * lam_i[row]
        push_y += C[row, 1] * lam_i[row]
        g = a[row] * rho + C[row, 0] * z_i[0] + C[row, 1] * z_i[1] - d[row]  # eq. 13
        # eq. 29: the switch; the clip ends the last explicit step at lambda = 0, where the flow would stop
        switched = lam_i[row] > 0.0 or g > 0.0
        new[2][i, row] = min(max(lam_i[row] + step * g, 0.0), cap) if switched else 0.0
    weight = pull / rho if rho > 0.0 else 0.0  # 0 is a subgradient of rho at its kink

    grad_x = 2.0 * delta * (z_i[0] - r[0]) + push_x  # grad f_i + grad g_i' lambda_i
    grad_y = 2.0 * delta * (z_i[1] - r[1]) + push_y
    for c in range(size):
        lead = lead_zeta = 0.0  # sum_k L_ik z_k and sum_k L_ik zeta_k
        for k in at:
            lead += z_i[c] - seen_z[k, c]
            lead_zeta += zeta_i[c] - seen_zeta[k, c]
        new[1][i, c] = zeta_i[c] - step * lead  # eq. 25, second row
        if c >= 2 + 2 * n:
            gradient = weight * z_i[c]
        elif c >= 2:
            off = z_i[c % 2] - z_i[c]
            gradient = -weight * off
            if c % 2 == 0:
                grad_x += weight * off
            else:
                grad_y += weight * off
        else:
            gradient = 0.0
        new[0][i, c] = z_i[c] - step * (lead - lead_zeta + alpha * gradient)  # eq. 25, first row
    new[0][i, 0] -= step * alpha * grad_x
    new[0][i, 1] -= step * alpha * grad_y

    for axis in range(2):  # grad h_i' nu_i acts on robot i's own blocks; eq. 30
        at_p, at_xi = 2 + 2 * i + axis, 2 + 2 * n + 2 * i + axis
        new[0][i, at_p] -= step * alpha * nu_i[axis]
        new[0][i, at_xi] -= step * alpha * nu_i[2 + axis]
        new[3][i, axis] = nu_i[axis] + step * (z_i[at_p] - p[axis])
        new[3][i, 2 + axis] = nu_i[2 + axis] + step * (z_i[at_xi] - xi[axis])


@kernel
def _rho(z):  # pragma: no cover - compiled
    """Return rho(m, z_p, z_xi) of one robot's estimate."""
    n = (len(z) - 2) // 4
    total = 0.0
    for c in range(2, 2 + 2 * n):
        total += (z[c % 2] - z[c]) ** 2
    for c in range(2 + 2 * n, len(z)):
        total += z[c] ** 2
    return np.sqrt(total)
