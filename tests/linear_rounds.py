"""The round linearised at a problem's optimum, from the equations: which steps its modes bear."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed import equations
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import rho

ZERO = 1e-7  # modes this slow are those that the flow conserves, and multipliers that balance each other


class Parts(NamedTuple):
    """Of all robots' z, one after the other, and of (nu, lambda of rows that bind), at the optimum."""

    L: np.ndarray
    cost: np.ndarray  # second derivatives of sum f_i
    bend: np.ndarray  # of sum g_i' lambda_i
    linear: np.ndarray  # gradients of h, and C of rows
    slope: np.ndarray  # a grad rho of rows


def parts_at(problem: Problem, optimum: Optimum) -> Parts:
    """Return the round's parts; rows count where their multiplier is above 1e-6."""
    net, n = problem.network, problem.network.robots
    N, owner_row = 4 * n + 2, np.argwhere(optimum.multipliers > 1e-6)
    E = np.zeros((4 * n, N))  # z -> (1 (x) m - z_p, z_xi)
    E[: 2 * n, :2] = np.tile(np.eye(2), (n, 1))
    E[: 2 * n, 2 : 2 + 2 * n], E[2 * n :, 2 + 2 * n :] = -np.eye(2 * n), np.eye(2 * n)
    y = E @ np.concatenate([optimum.m, problem.p.reshape(-1), problem.xi.reshape(-1)])
    radius = rho(optimum.m, problem.p, problem.xi)
    size, gradient = n * N, E.T @ y / radius
    curvature = E.T @ (np.eye(4 * n) - np.outer(y, y) / radius**2) @ E / radius
    linear, slope = np.zeros((2, size, 4 * n + len(owner_row)))
    cost, bend = np.zeros((2, size, size))
    for i in range(n):
        block = slice(i * N, (i + 1) * N)
        bend[block, block] += problem.rows.a[i] @ optimum.multipliers[i] * curvature
        cost[i * N, i * N] = cost[i * N + 1, i * N + 1] = 2.0 * net.leader[i]
        for axis in range(2):
            linear[i * N + 2 + 2 * i + axis, 4 * i + axis] = 1.0
            linear[i * N + 2 + 2 * n + 2 * i + axis, 4 * i + 2 + axis] = 1.0
    for k, (i, row) in enumerate(owner_row):
        slope[i * N : (i + 1) * N, 4 * n + k] = problem.rows.a[i, row] * gradient
        linear[i * N : i * N + 2, 4 * n + k] = problem.rows.C[i, row]
    return Parts(np.kron(net.laplacian, np.eye(N)), cost, bend, linear, slope)


def modes_at(problem: Problem, optimum: Optimum, alpha: float) -> np.ndarray:
    """Return the eigenvalues mu of the flow (25)-(30) about its rest; an explicit round multiplies by 1 + h mu."""
    L, cost, bend, linear, slope = parts_at(problem, optimum)
    held = np.sqrt(alpha) * (linear + slope)  # multipliers times sqrt(alpha): the same eigenvalues, a skew coupling
    zero, nothing = np.zeros_like(held), np.zeros((held.shape[1],) * 2)
    J = np.block([[-L - alpha * (cost + bend), L, -held], [-L, np.zeros_like(L), zero], [held.T, zero.T, nothing]])
    return np.linalg.eigvals(J)


def proximal_factors_at(problem: Problem, optimum: Optimum, alpha: float, step: float) -> np.ndarray:
    """Return by what a proximal round multiplies its modes about its rest."""
    L, cost, bend, linear, slope = parts_at(problem, optimum)
    root, one, (size, held) = step * np.sqrt(alpha), np.eye(len(L)), linear.shape
    zero = np.zeros((held, size))
    after = np.block(
        [[one + step * alpha * (cost + bend), root * slope], [-root * (slope + 2.0 * linear).T, np.eye(held)]]
    )
    before = np.block([[one - step * L, step * L, -root * linear], [-root * linear.T, zero, np.eye(held)]])
    moved = np.linalg.solve(after, before)
    return np.linalg.eigvals(np.block([[moved[:size]], [-step * L, one, zero.T], [moved[size:]]]))


def longest_step(modes: np.ndarray) -> float:
    """Return the step up to which all modes decay [s]."""
    moving = modes[np.abs(modes) > ZERO]
    return float(np.min(-2.0 * moving.real / np.abs(moving) ** 2))


def spectral_radius(factors: np.ndarray) -> float:
    """Return the largest factor of what moves."""
    return float(np.abs(factors[np.abs(factors - 1.0) > ZERO]).max())


def differentiated_round(
    problem: Problem, optimum: Optimum, rest: Estimates, flow: Flow
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much a plain round moves estimates at `rest`, and its Jacobian there, by central differences.

    The Jacobian is that of all numbers but the multipliers of rows that do not bind, which stay at 0.
    """
    moving = [np.ones_like(rest.z), np.ones_like(rest.zeta), optimum.multipliers > 1e-6, np.ones_like(rest.nu)]
    places = np.flatnonzero(np.concatenate([part.reshape(-1) for part in moving]))
    values, cuts = np.concatenate([part.reshape(-1) for part in rest]), np.cumsum([part.size for part in rest])[:-1]

    def one_round(vector: np.ndarray) -> np.ndarray:
        parts = np.split(vector, cuts)
        estimates = Estimates(*(part.reshape(like.shape) for part, like in zip(parts, rest, strict=True)))
        return np.concatenate([part.reshape(-1) for part in equations.run_rounds(problem, estimates, flow, 1)])

    jacobian = np.empty((len(places), len(places)))
    for column, place in enumerate(places):
        off = np.zeros(len(values))
        off[place] = 1e-6 * max(1.0, abs(values[place]))
        change = one_round(values + off)[places] - one_round(values - off)[places]
        jacobian[:, column] = change / (2.0 * off[place])
    return one_round(values) - values, jacobian
