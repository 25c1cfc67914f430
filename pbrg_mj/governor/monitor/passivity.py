"""The passivity argument of the paper's convergence proof, as numbers (Lemmas 2 to 4, with the errata fixed).

The flow is a feedback of two subsystems: PI consensus with gradient descent, and dual ascent. Between any two of its
motions on one problem, with differences d, storages S = (||dz||^2 + ||dzeta||^2) / 2 and
U = (||dlambda||^2 + ||dnu||^2) / 2, each gives back no more than it is supplied with:

    supply - dS/dt = dz' L dz + alpha dz' d(grad f)  >= 0
    supply - dU/dt >= 0  because every g_i is convex

The supplies cancel in S + alpha U, which therefore never grows. Two second motions make two numbers:

- `passivity`: the rest at the optimum (z*, zeta*, lambda*, nu*), as in the paper. Needs an optimum.
- `flow_passivity`: the same motion a round later (differences are velocities, S + alpha U the flow's own speed). Needs
  nothing, not even that there is an optimum; known as incremental passivity.

The kernels index whole arrays instead of taking rows and sums of columns, as `primal_dual.update_robots` explains.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.rounds import Estimates, Flow
from pbrg_mj.governor.monitor.equilibrium import dual_force, equilibrium_arguments, equilibrium_arrays
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel


class Passivity(NamedTuple):
    """Storages of the difference of two motions, and what each subsystem dissipates.

    In m^2 and m^2/s about the optimum, in m^2/s^2 and m^2/s^3 of the flow's own velocity.
    """

    primal_storage: float  # S
    dual_storage: float  # U
    primal_dissipation: float  # supply - dS/dt; >= 0: passive
    dual_dissipation: float  # supply - dU/dt; >= 0: passive

    @classmethod
    def unknown(cls) -> Passivity:
        """Return NaN: there is no optimum, the flow has left all bounds, or the governor has no balance."""
        return cls(np.nan, np.nan, np.nan, np.nan)

    @classmethod
    def from_rows(cls, balances: np.ndarray) -> list[Passivity]:
        """Return the balance of every row (T, 4), unknown where a number is not finite. Changes such rows."""
        balances[~np.isfinite(balances).all(axis=1)] = np.nan
        return list(map(cls, *balances.T.tolist()))


def passivity(problem: Problem, optimum: Optimum, alpha: float, before: Estimates, rates: Estimates) -> Passivity:
    """Return the passivity balance at `before` when the estimates move at `rates` (a round's change over its step).

    The balance belongs to the flow as it was really integrated and exchanged: loss, delay or a wrong update show in
    its sign.
    """
    motions = tuple((one.z, one.zeta, one.lam, one.nu) for one in (before, rates))
    return Passivity(*balance_about_optimum(equilibrium_arguments(problem, optimum, alpha), *motions))


@kernel
def balance_about_optimum(about, before, rates):  # pragma: no cover - compiled
    """Compute what `passivity` returns; `about` are `equilibrium_arguments`."""
    lam, rows, alpha = about[1], about[2], about[5]
    z_1, zeta_1, lam_1, nu_1 = before
    z_rate, zeta_rate, lam_rate, nu_rate = rates
    z, zeta, nu, rest = equilibrium_arrays(*about, _mean_row(zeta_1))
    supply = _supply(z, z_1, rest, dual_force(z_1, lam_1, nu_1, rows))
    stored_z, growth_z = _difference(z, z_1, z_rate)
    stored_zeta, growth_zeta = _difference(zeta, zeta_1, zeta_rate)
    stored_lam, growth_lam = _difference(lam, lam_1, lam_rate)
    stored_nu, growth_nu = _difference(nu, nu_1, nu_rate)
    primal, dual = -alpha * supply - growth_z - growth_zeta, supply - growth_lam - growth_nu
    return stored_z + stored_zeta, stored_lam + stored_nu, primal, dual


@kernel
def _mean_row(array):  # pragma: no cover - compiled
    mean = np.zeros(array.shape[1])
    for i in range(array.shape[0]):
        for c in range(array.shape[1]):
            mean[c] += array[i, c] / array.shape[0]
    return mean


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
    (balance,) = Passivity.from_rows(
        np.array([flow_balance(arrays, (problem.rows.a, problem.rows.C), flow.alpha, flow.step)])
    )
    return balance


@kernel
def flow_balance(rounds, rows, alpha, step):  # pragma: no cover - compiled
    """Compute what `flow_passivity` returns; `rows` are a and C."""
    (z, zeta, lam, nu), (z_1, zeta_1, lam_1, nu_1), (z_2, zeta_2, lam_2, nu_2) = rounds
    before, after = dual_force(z, lam, nu, rows), dual_force(z_1, lam_1, nu_1, rows)
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
