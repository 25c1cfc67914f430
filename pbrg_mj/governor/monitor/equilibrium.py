"""Where the flow comes to rest: its equilibrium at an optimum, in closed form, and the force of rows and pinned states.

The kernels index whole arrays instead of taking rows and sums of columns, as `rounds.update_robots` explains.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel


def equilibrium(problem: Problem, optimum: Optimum, alpha: float, zeta_mean: np.ndarray) -> Estimates:
    """Return the flow's equilibrium at the optimum, in closed form (the paper's Lemma 2 says it exists).

    z_i = (m*, p, xi) for all robots; nu balances grad g' lambda in each robot's own blocks; L zeta balances what is
    left. The mean of zeta, (4n + 2,), is conserved by the flow and therefore given.
    """
    z, zeta, nu, _ = equilibrium_arrays(equilibrium_arguments(problem, optimum, alpha), zeta_mean)
    return Estimates(z, zeta, optimum.multipliers, nu)


class OptimumArrays(NamedTuple):
    """What kernels take of an optimum and its problem."""

    m: np.ndarray  # (2,) m* [m]
    p: np.ndarray  # (n, 2) [m]
    xi: np.ndarray  # (n, 2) [m]
    lam: np.ndarray  # (n, R) lambda*
    a: np.ndarray  # (n, R)
    C: np.ndarray  # (n, R, 2)
    along: np.ndarray  # (n, R, 2), or (0, 0, 2)
    leader: np.ndarray  # (n,) delta
    reference: np.ndarray  # (n, 2) r_i [m]
    laplacian_pinv: np.ndarray  # (n, n)
    alpha: float


def equilibrium_arguments(problem: Problem, optimum: Optimum, alpha: float) -> tuple:
    """Return `OptimumArrays` as a plain tuple."""
    network, rows = problem.network, problem.rows
    states, aims = (optimum.m, problem.p, problem.xi), (network.leader, problem.near_references)
    return (*states, optimum.multipliers, rows.a, rows.C, rows.along, *aims, network.laplacian_pinv, alpha)


@kernel
def equilibrium_arrays(optimum_arrays, zeta_mean):
    """Return z, zeta (n, 4n + 2), nu (n, 4), and grad g_i' lambda_i + grad h_i' nu_i of every robot, (n, 4n + 2).

    `optimum_arrays` are the members of `OptimumArrays`, `zeta_mean` (4n + 2,) the mean of zeta over the robots.
    """
    optimum = OptimumArrays(*optimum_arrays)
    z, nu, force = _primal_and_nu(optimum)
    pushed, m, r, leader = optimum.alpha * force, optimum.m, optimum.reference, optimum.leader
    for i in range(len(leader)):
        for axis in range(2):
            pushed[i, axis] = optimum.alpha * (force[i, axis] + 2.0 * leader[i] * (m[axis] - r[i, axis]))
    zeta = optimum.laplacian_pinv @ pushed
    for i in range(zeta.shape[0]):
        for c in range(zeta.shape[1]):
            zeta[i, c] += zeta_mean[c]
    return z, zeta, nu, force


@kernel
def _primal_and_nu(optimum):
    """Return z, nu, and the force of all rows and of nu, which cancels it in z_p and z_xi as a sum over the robots."""
    m, p, xi = optimum.m, optimum.p, optimum.xi
    n = len(p)
    z, nu = np.empty((n, 4 * n + 2)), np.zeros((n, 4))
    for i in range(n):
        for axis in range(2):
            z[i, axis] = m[axis]
            for j in range(n):
                z[i, 2 + 2 * j + axis], z[i, 2 + 2 * n + 2 * j + axis] = p[j, axis], xi[j, axis]
    force = dual_force(z, optimum.lam, nu, optimum.a, optimum.C, optimum.along)
    for j in range(n):
        for axis in range(2):
            at_p, at_xi = 2 + 2 * j + axis, 2 + 2 * n + 2 * j + axis
            sum_p = sum_xi = 0.0
            for i in range(n):
                sum_p += force[i, at_p]
                sum_xi += force[i, at_xi]
            nu[j, axis], nu[j, 2 + axis] = -sum_p, -sum_xi
            force[j, at_p] -= sum_p
            force[j, at_xi] -= sum_xi
    return z, nu, force


@kernel
def dual_force(z, lam, nu, a, C, along):
    """Return Gamma lambda + Psi nu (eqs. 26, 27): grad g_i(z_i)' lambda_i + grad h_i' nu_i of every robot, (n, 4n + 2).

    z (n, 4n + 2), lam (n, R), nu (n, 4), a (n, R), C (n, R, 2), along (n, R, 2) or (0, 0, 2).
    """
    if len(along) > 0:
        return _dual_force_along(z, lam, nu, a, C, along)
    n, force = len(z), np.empty(z.shape)
    for i in range(n):
        pull = push_x = push_y = square = 0.0
        for row in range(a.shape[1]):
            if lam[i, row] != 0.0:  # few are
                pull += a[i, row] * lam[i, row]
                push_x += C[i, row, 0] * lam[i, row]
                push_y += C[i, row, 1] * lam[i, row]
        for c in range(2, 2 + 2 * n, 2):  # (z_p - 1 (x) m, z_xi)
            force[i, c], force[i, c + 1] = z[i, c] - z[i, 0], z[i, c + 1] - z[i, 1]
            square += force[i, c] * force[i, c]
            square += force[i, c + 1] * force[i, c + 1]
        for c in range(2 + 2 * n, 2 + 4 * n):
            force[i, c] = z[i, c]
            square += force[i, c] * force[i, c]
        rho = math.sqrt(square)
        weight = pull / rho if rho > 0.0 else 0.0
        for c in range(2, 2 + 4 * n):
            force[i, c] *= weight
        for c in range(2, 2 + 2 * n, 2):
            push_x -= force[i, c]
            push_y -= force[i, c + 1]
        force[i, 0], force[i, 1] = push_x, push_y
        for axis in range(2):
            force[i, 2 + 2 * i + axis] += nu[i, axis]
            force[i, 2 + 2 * n + 2 * i + axis] += nu[i, 2 + axis]
    return force


@kernel
def _dual_force_along(z, lam, nu, a, C, along):
    """Return the same for rows that have directions."""
    n, force = len(z), np.zeros(z.shape)
    for i in range(n):
        for row in range(a.shape[1]):
            if lam[i, row] == 0.0:
                continue
            force[i, 0] += C[i, row, 0] * lam[i, row]
            force[i, 1] += C[i, row, 1] * lam[i, row]
            _add_pull_along(z, i, a[i, row] * lam[i, row], along[i, row, 0], along[i, row, 1], force)
        for axis in range(2):
            force[i, 2 + 2 * i + axis] += nu[i, axis]
            force[i, 2 + 2 * n + 2 * i + axis] += nu[i, 2 + axis]
    return force


@kernel
def _add_pull_along(z, i, pull, G_x, G_y, force):
    """Add `pull` times grad ||x_G(z_i)|| to the force (n, 4n + 2) on robot i."""
    n, square = len(z), 0.0
    for c in range(2, 2 + 2 * n, 2):
        square += (G_x * (z[i, c] - z[i, 0]) + G_y * (z[i, c + 1] - z[i, 1])) ** 2
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        square += (G_x * z[i, c] + G_y * z[i, c + 1]) ** 2
    weight = pull / math.sqrt(square) if square > 0.0 else 0.0
    for c in range(2, 2 + 2 * n, 2):
        e = weight * (G_x * (z[i, c] - z[i, 0]) + G_y * (z[i, c + 1] - z[i, 1]))
        force[i, c] += e * G_x
        force[i, c + 1] += e * G_y
        force[i, 0] -= e * G_x
        force[i, 1] -= e * G_y
    for c in range(2 + 2 * n, 2 + 4 * n, 2):
        s = weight * (G_x * z[i, c] + G_y * z[i, c + 1])
        force[i, c] += s * G_x
        force[i, c + 1] += s * G_y
