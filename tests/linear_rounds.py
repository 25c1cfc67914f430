"""The round linearised at a problem's optimum, from the equations: which steps its modes bear."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import rho

ZERO = 1e-7  # modes this slow are those that the flow conserves, and multipliers that balance each other


def modes_at(problem: Problem, optimum: Optimum, alpha: float) -> np.ndarray:
    """Return the eigenvalues mu of the flow (25)-(30) about its rest at the optimum; a round multiplies by 1 + h mu.

    Rows count where their multiplier is above 1e-6.
    """
    net, n = problem.network, problem.network.robots
    N, owner_row = 4 * n + 2, np.argwhere(optimum.multipliers > 1e-6)
    E = np.zeros((4 * n, N))  # z -> (1 (x) m - z_p, z_xi)
    E[: 2 * n, :2] = np.tile(np.eye(2), (n, 1))
    E[: 2 * n, 2 : 2 + 2 * n], E[2 * n :, 2 + 2 * n :] = -np.eye(2 * n), np.eye(2 * n)
    y = E @ np.concatenate([optimum.m, problem.p.reshape(-1), problem.xi.reshape(-1)])
    radius = rho(optimum.m, problem.p, problem.xi)
    slope = E.T @ y / radius
    bend = E.T @ (np.eye(4 * n) - np.outer(y, y) / radius**2) @ E / radius
    L = np.kron(net.laplacian, np.eye(N))
    size = n * N
    held = np.zeros((size, 4 * n + len(owner_row)))  # gradients of h and of the rows that bind
    H = np.zeros((size, size))
    for i in range(n):
        block = slice(i * N, (i + 1) * N)
        H[block, block] += problem.rows.a[i] @ optimum.multipliers[i] * bend
        H[i * N, i * N] += 2.0 * net.leader[i]
        H[i * N + 1, i * N + 1] += 2.0 * net.leader[i]
        for axis in range(2):
            held[i * N + 2 + 2 * i + axis, 4 * i + axis] = 1.0
            held[i * N + 2 + 2 * n + 2 * i + axis, 4 * i + 2 + axis] = 1.0
    for k, (i, row) in enumerate(owner_row):
        held[i * N : (i + 1) * N, 4 * n + k] = problem.rows.a[i, row] * slope
        held[i * N : i * N + 2, 4 * n + k] += problem.rows.C[i, row]
    root = np.sqrt(alpha)  # multipliers times this: the same eigenvalues, and the coupling is skew
    zero, nothing = np.zeros((size, held.shape[1])), np.zeros((held.shape[1],) * 2)
    J = np.block(
        [[-L - alpha * H, L, -root * held], [-L, np.zeros((size, size)), zero], [root * held.T, zero.T, nothing]]
    )
    return np.linalg.eigvals(J)


def longest_step(modes: np.ndarray) -> float:
    """Return the step up to which all modes decay [s]."""
    moving = modes[np.abs(modes) > ZERO]
    return float(np.min(-2.0 * moving.real / np.abs(moving) ** 2))
