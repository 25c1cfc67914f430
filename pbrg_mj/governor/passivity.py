"""The passivity argument of the paper's convergence proof, as numbers (Lemmas 2 to 4, with the slips mended).

The flow is a feedback of two subsystems: PI consensus with gradient descent, and dual ascent. Between any two of its
motions on one problem, with differences d, storages S = (||dz||^2 + ||dzeta||^2) / 2 and
U = (||dlambda||^2 + ||dnu||^2) / 2, each gives back no more than it is supplied with:

    supply - dS/dt = dz' L dz + alpha dz' d(grad f)  >= 0
    supply - dU/dt >= 0  because every g_i is convex

The supplies cancel in S + alpha U, which therefore never grows. Two second motions make two numbers:

- `passivity`: the rest at the optimum (z*, zeta*, lambda*, nu*), as in the paper. Needs an optimum.
- `flow_passivity`: the same motion a round later (differences are velocities, S + alpha U the flow's own speed). Needs
  nothing, not even that there is an optimum; known as incremental passivity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.bounds import judged
from pbrg_mj.governor.optimum import Optimum
from pbrg_mj.governor.primal_dual import Estimates, Flow, round_arguments, rounds_of
from pbrg_mj.governor.problem import Problem
from pbrg_mj.kernel import kernel


@dataclass(frozen=True)
class Passivity:
    """Storages of the difference of two motions, and what each subsystem dissipates.

    In m^2 and m^2/s about the optimum, in m^2/s^2 and m^2/s^3 of the flow's own velocity.
    """

    primal_storage: float  # S
    dual_storage: float  # U
    primal_dissipation: float  # supply - dS/dt; >= 0: passive
    dual_dissipation: float  # supply - dU/dt; >= 0: passive

    @classmethod
    def unknown(cls) -> Passivity:
        """Return what is known about no optimum, of a flow past all bounds, of another governor's: NaN."""
        return cls(np.nan, np.nan, np.nan, np.nan)


def passivity(problem: Problem, optimum: Optimum, alpha: float, before: Estimates, rates: Estimates) -> Passivity:
    """Return the passivity balance at `before` when the estimates move at `rates` (a round's change over its step).

    The balance belongs to the flow as it was really integrated and exchanged: loss, delay or a wrong update show in
    its sign.
    """
    motions = tuple((one.z, one.zeta, one.lam, one.nu) for one in (before, rates))
    return Passivity(*_balance(_rest_arguments(problem, optimum, alpha), *motions))


def one_round_passivity(
    problem: Problem, optimum: Optimum, flow: Flow, estimates: Estimates, limit: float
) -> Passivity:
    """Return `passivity` of a state and the round that follows when every message arrives within it.

    Unknown where that round leaves `limit` [m] or is not finite.
    """
    rest = _rest_arguments(problem, optimum, flow.alpha)
    bounded, balance = _one_round_balance(*round_arguments(problem, estimates, flow), rest, limit)
    return Passivity(*balance) if bounded else Passivity.unknown()


@kernel
def _one_round_balance(estimates, network, state, rows, gains, rest_arguments, limit):  # pragma: no cover - compiled
    z, zeta, lam, nu = rounds_of(estimates, network, state, rows, gains, 1)
    bounded, _ = judged(z, lam, limit, gains[2])
    step = gains[1]
    rates = (
        (z - estimates[0]) / step,
        (zeta - estimates[1]) / step,
        (lam - estimates[2]) / step,
        (nu - estimates[3]) / step,
    )
    return bounded, _balance(rest_arguments, estimates, rates)


@kernel
def _balance(rest_arguments, before, rates):  # pragma: no cover - compiled
    lam, rows, alpha = rest_arguments[1], rest_arguments[2], rest_arguments[5]
    z_1, zeta_1, lam_1, nu_1 = before
    z_rate, zeta_rate, lam_rate, nu_rate = rates
    zeta_mean = np.zeros(zeta_1.shape[1])
    for i in range(len(zeta_1)):
        zeta_mean += zeta_1[i] / len(zeta_1)
    z, zeta, nu = _equilibrium(*rest_arguments, zeta_mean)
    rest, now = _dual_force(z, lam, nu, rows), _dual_force(z_1, lam_1, nu_1, rows)
    supply = _supply(z, z_1, rest, now)
    stored_z, growth_z = _difference(z, z_1, z_rate)
    stored_zeta, growth_zeta = _difference(zeta, zeta_1, zeta_rate)
    stored_lam, growth_lam = _difference(lam, lam_1, lam_rate)
    stored_nu, growth_nu = _difference(nu, nu_1, nu_rate)
    primal, dual = -alpha * supply - growth_z - growth_zeta, supply - growth_lam - growth_nu
    return stored_z + stored_zeta, stored_lam + stored_nu, primal, dual


@kernel
def _supply(z, other_z, force, other_force):  # pragma: no cover - compiled
    """Return the product of the differences of two states and of the forces there."""
    supply = 0.0
    for i in range(z.shape[0]):
        for c in range(z.shape[1]):
            supply += (other_z[i, c] - z[i, c]) * (other_force[i, c] - force[i, c])
    return supply


@kernel
def _difference(rest, now, rate):  # pragma: no cover - compiled
    """Return half the square of an array's difference from its rest, and the rate at which that grows."""
    square = growth = 0.0
    for i in range(rest.shape[0]):
        for c in range(rest.shape[1]):
            off = now[i, c] - rest[i, c]
            square += off * off
            growth += off * rate[i, c]
    return 0.5 * square, growth


def flow_passivity(problem: Problem, flow: Flow, rounds: tuple[Estimates, Estimates, Estimates]) -> Passivity:
    """Return the passivity balance of the flow's own velocity over three successive states on one problem.

    Explicit rounds add half the square of a round's change; where a multiplier steps to its end, the clip may add as
    much once. Where the flow is at rest the signs are those of rounding.
    """
    arrays = tuple((one.z, one.zeta, one.lam, one.nu) for one in rounds)
    return _known(_flow_balance(arrays, (problem.rows.a, problem.rows.C), flow.alpha, flow.step))


def two_rounds_passivity(problem: Problem, flow: Flow, estimates: Estimates) -> Passivity:
    """Return `flow_passivity` of a state and the two rounds that follow when every message arrives within its round."""
    return _known(_two_rounds_balance(*round_arguments(problem, estimates, flow)))


def _known(balance: tuple[float, float, float, float]) -> Passivity:
    return Passivity(*balance) if math.isfinite(sum(balance)) else Passivity.unknown()


@kernel
def _two_rounds_balance(estimates, network, state, rows, gains):  # pragma: no cover - compiled
    first = rounds_of(estimates, network, state, rows, gains, 1)
    second = rounds_of(first, network, state, rows, gains, 1)
    return _flow_balance((estimates, first, second), (rows[0], rows[1]), gains[0], gains[1])


@kernel
def _flow_balance(rounds, rows, alpha, step):  # pragma: no cover - compiled
    (z, zeta, lam, nu), (z_1, zeta_1, lam_1, nu_1), (z_2, zeta_2, lam_2, nu_2) = rounds
    before, after = _dual_force(z, lam, nu, rows), _dual_force(z_1, lam_1, nu_1, rows)
    supply = _supply(z, z_1, before, after) / step**2
    speed_z, growth_z = _motion(z, z_1, z_2, step)
    speed_zeta, growth_zeta = _motion(zeta, zeta_1, zeta_2, step)
    speed_lam, growth_lam = _motion(lam, lam_1, lam_2, step)
    speed_nu, growth_nu = _motion(nu, nu_1, nu_2, step)
    primal, dual = -alpha * supply - growth_z - growth_zeta, supply - growth_lam - growth_nu
    return speed_z + speed_zeta, speed_lam + speed_nu, primal, dual


@kernel
def _motion(first, second, third, step):  # pragma: no cover - compiled
    """Return half the square of the velocity v, and v . dv/dt, of an array in three successive rounds."""
    square = growth = 0.0
    for i in range(first.shape[0]):
        for c in range(first.shape[1]):
            v = second[i, c] - first[i, c]
            square += v * v
            growth += v * (third[i, c] - second[i, c] - v)
    return 0.5 * square / step**2, growth / step**3


def equilibrium(problem: Problem, optimum: Optimum, alpha: float, zeta_mean: np.ndarray) -> Estimates:
    """Return the flow's equilibrium at the optimum, in closed form (the paper's Lemma 2 says it exists).

    z_i = (m*, p, xi) for all robots; nu balances grad g' lambda in each robot's own blocks; L zeta balances what is
    left. The mean of zeta, (4n + 2,), is conserved by the flow and therefore given.
    """
    z, zeta, nu = _equilibrium(*_rest_arguments(problem, optimum, alpha), zeta_mean)
    return Estimates(z, zeta, optimum.multipliers, nu)


def _rest_arguments(problem: Problem, optimum: Optimum, alpha: float) -> tuple:
    """Return the first six arguments of `_equilibrium`."""
    network, rows = problem.network, problem.rows
    state, aims = (optimum.m, problem.p, problem.xi), (network.leader, problem.reference)
    return state, optimum.multipliers, (rows.a, rows.C), aims, network.laplacian_pinv, alpha


@kernel
def _equilibrium(state, lam, rows, aims, pinv, alpha, zeta_mean):  # pragma: no cover - compiled
    z, nu, force = _at_rest(state, lam, rows, aims)
    return z, pinv @ (alpha * force) + zeta_mean, nu


@kernel
def _at_rest(state, lam, rows, aims):  # pragma: no cover - compiled
    """Return z, nu, and grad f_i + grad g_i' lambda_i + grad h_i' nu_i of every robot, (n, 4n + 2)."""
    m, p, xi = state
    leader, r = aims
    n = len(p)
    z, nu = np.empty((n, 4 * n + 2)), np.zeros((n, 4))
    z[:, 0], z[:, 1] = m[0], m[1]
    for j in range(n):
        for axis in range(2):
            z[:, 2 + 2 * j + axis], z[:, 2 + 2 * n + 2 * j + axis] = p[j, axis], xi[j, axis]
    force = _dual_force(z, lam, nu, rows)
    for j in range(n):
        for axis in range(2):  # of all rows; nu must cancel it in z_p and z_xi
            at_p, at_xi = 2 + 2 * j + axis, 2 + 2 * n + 2 * j + axis
            nu[j, axis], nu[j, 2 + axis] = -force[:, at_p].sum(), -force[:, at_xi].sum()
            force[j, at_p] += nu[j, axis]
            force[j, at_xi] += nu[j, 2 + axis]
            force[j, axis] += 2.0 * leader[j] * (m[axis] - r[axis])
    return z, nu, force


def dual_force(problem: Problem, estimates: Estimates) -> np.ndarray:
    """Return grad g_i(z_i)' lambda_i + grad h_i' nu_i of every robot, (n, 4n + 2)."""
    rows = problem.rows
    return _dual_force(estimates.z, estimates.lam, estimates.nu, (rows.a, rows.C))


@kernel
def _dual_force(z, lam, nu, rows):  # pragma: no cover - compiled
    a, C = rows
    n, force = len(z), np.zeros(z.shape)
    for i in range(n):
        pull, z_i = 0.0, z[i]
        for row in range(a.shape[1]):
            pull += a[i, row] * lam[i, row]
            force[i, 0] += C[i, row, 0] * lam[i, row]
            force[i, 1] += C[i, row, 1] * lam[i, row]
        ball = z_i.copy()  # (., z_p - 1 (x) m, z_xi)
        for c in range(2, 2 + 2 * n):
            ball[c] -= z_i[c % 2]
        rho = np.sqrt(np.sum(ball[2:] ** 2))
        weight = pull / rho if rho > 0.0 else 0.0
        for c in range(2, len(z_i)):
            force[i, c] = weight * ball[c]
            force[i, c % 2] -= weight * ball[c] if c < 2 + 2 * n else 0.0
        for axis in range(2):
            force[i, 2 + 2 * i + axis] += nu[i, axis]
            force[i, 2 + 2 * n + 2 * i + axis] += nu[i, 2 + axis]
    return force
