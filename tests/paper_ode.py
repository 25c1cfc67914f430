"""The paper's coupled system as one ordinary differential equation, written from eqs. 2 and 25-30 as matrices.

It shares no code with the package: state y = (p, xi, z, zeta, lambda, nu) stacked, Kronecker products spelled out,
gradients of rho in closed form, one explicit Euler step after the other.
"""

from __future__ import annotations

import numpy as np
from numba import njit

FORMATION = np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])
START = np.array([[-2.0, 0.7], [-1.4, -1.0], [0.2, -1.4], [1.2, -3.0], [0.0, 0.0]])
ADJACENCY = np.array(
    [[0, 1, 0, 0, 1], [1, 0, 1, 0, 0], [0, 1, 0, 1, 0], [0, 0, 1, 0, 1], [1, 0, 0, 1, 0]], dtype=float
)  # eq. 45
LEADER = 4
N = 22


@njit
def _integrate(p, r, alpha, alpha_r, step, every, samples, constants):
    Lq, Lz, normal, bound = constants
    xi, z, zeta = np.zeros(10), np.zeros(110), np.zeros(110)
    lam, nu = np.zeros(5), np.zeros(20)
    out = np.zeros((samples + 1, 20))
    for k in range(samples * every + 1):
        if k % every == 0:
            out[k // every, :10] = p
            for i in range(5):
                out[k // every, 10 + 2 * i : 12 + 2 * i] = z[N * i : N * i + 2]
        # eq. 2
        dp = -Lq @ (p - xi)
        m5 = z[N * LEADER : N * LEADER + 2]
        dp[8:10] += alpha_r * (m5 - p[8:10])
        dxi = -Lq @ p
        # eq. 25
        dz = -(Lz @ (z - zeta))
        dzeta = -(Lz @ z)
        dz[N * LEADER : N * LEADER + 2] -= alpha * 2.0 * (m5 - r)
        # the leader's line, one row for every robot: rho + G.(m + b_j) - h
        zl = z[N * LEADER : N * (LEADER + 1)]
        ball = np.empty(20)
        for j in range(5):
            ball[2 * j : 2 * j + 2] = zl[:2] - zl[2 + 2 * j : 4 + 2 * j]
        ball[10:] = zl[12:]
        rho = np.sqrt(np.sum(ball**2))
        dlam = np.zeros(5)
        for j in range(5):
            g = rho + normal[0] * zl[0] + normal[1] * zl[1] - bound[j]
            if lam[j] > 0.0 or g > 0.0:  # eq. 29
                dlam[j] = g
        total = lam.sum()
        grad = np.zeros(N)
        grad[:2] = total * normal
        if rho > 0.0:
            for j in range(5):
                grad[:2] += total / rho * ball[2 * j : 2 * j + 2]
                grad[2 + 2 * j : 4 + 2 * j] = -total / rho * ball[2 * j : 2 * j + 2]
            grad[12:] = total / rho * ball[10:]
        dz[N * LEADER : N * (LEADER + 1)] -= alpha * grad
        # h_i and its multipliers, eq. 30
        dnu = np.zeros(20)
        for i in range(5):
            own_p, own_xi = N * i + 2 + 2 * i, N * i + 12 + 2 * i
            dz[own_p : own_p + 2] -= alpha * nu[4 * i : 4 * i + 2]
            dz[own_xi : own_xi + 2] -= alpha * nu[4 * i + 2 : 4 * i + 4]
            dnu[4 * i : 4 * i + 2] = z[own_p : own_p + 2] - p[2 * i : 2 * i + 2]
            dnu[4 * i + 2 : 4 * i + 4] = z[own_xi : own_xi + 2] - xi[2 * i : 2 * i + 2]
        p = p + step * dp
        xi = xi + step * dxi
        z = z + step * dz
        zeta = zeta + step * dzeta
        lam = np.maximum(lam + step * dlam, 0.0)
        nu = nu + step * dnu
    return out


def paper_solution(r, duration, step, alpha=2.0, alpha_r=1.0, period=0.1):
    """Return hand points q and references m, each (samples, 5, 2), every `period` seconds from t = 0."""
    L = np.diag(ADJACENCY.sum(axis=1)) - ADJACENCY
    normal = np.array([1.0, 1.0]) / np.sqrt(2)
    bound = 3.0 / np.sqrt(2) - FORMATION @ normal
    constants = (np.kron(L, np.eye(2)), np.kron(L, np.eye(N)), normal, bound)
    every = round(period / step)
    p = (START - FORMATION).reshape(-1)
    out = _integrate(p, np.array(r, dtype=float), alpha, alpha_r, step, every, round(duration / period), constants)
    samples = out.reshape(-1, 2, 5, 2)
    return samples[:, 0] + FORMATION, samples[:, 1]
