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

The kernels index whole arrays instead of taking rows and sums of columns, as `rounds.update_robots` explains.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.optimum import Optimum
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.monitor.equilibrium import OptimumArrays, dual_force, equilibrium_arguments, equilibrium_arrays
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
    about = equilibrium_arguments(problem, optimum, alpha)
    return Passivity(*balance_about_optimum(about, tuple(before), tuple(rates)))


@kernel
def balance_about_optimum(optimum_arrays, before, rates):
    """Compute what `passivity` returns.

    `optimum_arrays` are the members of `OptimumArrays`, `before` and `rates` z, zeta, lam, nu of `Estimates`.
    """
    optimum, now, rate = OptimumArrays(*optimum_arrays), Estimates(*before), Estimates(*rates)
    z, zeta, nu, force = equilibrium_arrays(optimum_arrays, _mean_row(now.zeta))
    pushed = dual_force(now.z, now.lam, now.nu, optimum.a, optimum.C, optimum.along)
    supply = _supply(z, now.z, force, pushed)
    stored_z, growth_z = _difference(z, now.z, rate.z)
    stored_zeta, growth_zeta = _difference(zeta, now.zeta, rate.zeta)
    stored_lam, growth_lam = _difference(optimum.lam, now.lam, rate.lam)
    stored_nu, growth_nu = _difference(nu, now.nu, rate.nu)
    primal, dual = -optimum.alpha * supply - growth_z - growth_zeta, supply - growth_lam - growth_nu
    return stored_z + stored_zeta, stored_lam + stored_nu, primal, dual


@kernel
def _mean_row(array):
    """Return the mean row of an array (n, N)."""
    mean = np.zeros(array.shape[1])
    for i in range(array.shape[0]):
        for c in range(array.shape[1]):
            mean[c] += array[i, c] / array.shape[0]
    return mean


@kernel
def _supply(z, other_z, force, other_force):
    """Return the product of the differences of two states and of the forces there.

    Arguments: z, other_z, force, other_force (n, N).
    """
    supply = 0.0
    for i in range(z.shape[0]):
        for c in range(z.shape[1]):
            supply += (other_z[i, c] - z[i, c]) * (other_force[i, c] - force[i, c])
    return supply


@kernel
def _difference(rest, now, rate):
    """Return half the square of an array's difference from its rest, and the rate at which that grows.

    Arguments: rest, now, rate (n, N), the last that of the change of `now`.
    """
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
    first, second, third = map(tuple, rounds)
    rows = problem.rows
    balance = flow_balance(first, second, third, (rows.a, rows.C, rows.along), flow.alpha, flow.step)
    return Passivity.from_rows(np.array([balance]))[0]


@kernel
def flow_balance(first, second, third, row_arrays, alpha, step):
    """Compute what `flow_passivity` returns, of z, zeta, lam, nu of `Estimates` after three rounds in a row.

    `row_arrays` are a, C, along of `Rows`.
    """
    a, C, along = row_arrays
    x, y, w = Estimates(*first), Estimates(*second), Estimates(*third)
    before, after = dual_force(x.z, x.lam, x.nu, a, C, along), dual_force(y.z, y.lam, y.nu, a, C, along)
    supply = _supply(x.z, y.z, before, after) / step**2
    speed_z, growth_z = _motion(x.z, y.z, w.z, step)
    speed_zeta, growth_zeta = _motion(x.zeta, y.zeta, w.zeta, step)
    speed_lam, growth_lam = _motion(x.lam, y.lam, w.lam, step)
    speed_nu, growth_nu = _motion(x.nu, y.nu, w.nu, step)
    primal, dual = -alpha * supply - growth_z - growth_zeta, supply - growth_lam - growth_nu
    return speed_z + speed_zeta, speed_lam + speed_nu, primal, dual


@kernel
def _motion(first, second, third, step):
    """Return half the square of the velocity v, and v . dv/dt, of an array in three successive rounds.

    Arguments: first, second, third (n, N), `step` apart.
    """
    square = growth = 0.0
    for i in range(first.shape[0]):
        for c in range(first.shape[1]):
            v = second[i, c] - first[i, c]
            square += v * v
            growth += v * (third[i, c] - second[i, c] - v)
    return 0.5 * square / step**2, growth / step**3
