"""The passivity argument of the paper's convergence proof, as numbers (Lemmas 2 to 4, with the slips mended).

About the optimum (z*, zeta*, lambda*, nu*) the flow is a feedback of two subsystems: PI consensus with gradient
descent, storage S = (||z - z*||^2 + ||zeta - zeta*||^2) / 2, and dual ascent, storage
U = (||lambda - lambda*||^2 + ||nu - nu*||^2) / 2. Each gives back no more than it is supplied with:

    supply - dS/dt = (z - z*)' L (z - z*) + alpha (z - z*)' (grad f - grad f*)  >= 0
    supply - dU/dt >= 0  because every g_i is convex

The supplies cancel in S + alpha U, which therefore never grows on a static problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.optimum import Optimum
from pbrg_mj.governor.primal_dual import Estimates
from pbrg_mj.governor.problem import Problem


@dataclass(frozen=True)
class Passivity:
    """Storages about the centralized optimum, and what each subsystem dissipates."""

    primal_storage: float  # S
    dual_storage: float  # U
    primal_dissipation: float  # supply - dS/dt, per second; >= 0: passive
    dual_dissipation: float  # supply - dU/dt, per second; >= 0: passive

    @classmethod
    def unknown(cls) -> Passivity:
        """Return what is known without an optimum, or of a governor without this structure: NaN."""
        return cls(np.nan, np.nan, np.nan, np.nan)


def passivity(problem: Problem, optimum: Optimum, alpha: float, before: Estimates, rates: Estimates) -> Passivity:
    """Return the passivity balance at `before` when the estimates move at `rates` (a round's change over its step).

    The balance belongs to the flow as it was really integrated and exchanged: loss, delay or a wrong update show in
    its sign.
    """
    best = equilibrium(problem, optimum, alpha, before.zeta.mean(axis=0))
    off = Estimates(*(getattr(before, name) - getattr(best, name) for name in ("z", "zeta", "lam", "nu")))
    force = dual_force(problem, before) - dual_force(problem, best)
    supply = float(np.sum(off.z * force))
    growth = float(np.sum(off.z * rates.z) + np.sum(off.zeta * rates.zeta))
    dual_growth = float(np.sum(off.lam * rates.lam) + np.sum(off.nu * rates.nu))
    return Passivity(
        primal_storage=0.5 * float(np.sum(off.z**2) + np.sum(off.zeta**2)),
        dual_storage=0.5 * float(np.sum(off.lam**2) + np.sum(off.nu**2)),
        primal_dissipation=-alpha * supply - growth,
        dual_dissipation=supply - dual_growth,
    )


def equilibrium(problem: Problem, optimum: Optimum, alpha: float, zeta_mean: np.ndarray) -> Estimates:
    """Return the flow's equilibrium at the optimum, in closed form (the paper's Lemma 2 says it exists).

    z_i = (m*, p, xi) for all robots; nu balances grad g' lambda in each robot's own blocks; L zeta balances what is
    left. The mean of zeta, (4n + 2,), is conserved by the flow and therefore given.
    """
    n, network = problem.network.robots, problem.network
    z = np.tile(np.concatenate([optimum.m, problem.p.reshape(-1), problem.xi.reshape(-1)]), (n, 1))
    lam = optimum.multipliers
    bare = Estimates(z, np.zeros_like(z), lam, np.zeros((n, 4)))
    total = dual_force(problem, bare).sum(axis=0)  # of all rows; nu must cancel it in z_p and z_xi
    nu = -np.hstack([total[2 : 2 + 2 * n].reshape(n, 2), total[2 + 2 * n :].reshape(n, 2)])
    settled = Estimates(z, bare.zeta, lam, nu)
    force = dual_force(problem, settled)
    force[:, :2] += 2.0 * network.leader[:, None] * (z[:, :2] - problem.reference)  # grad f_i
    zeta = np.linalg.pinv(network.laplacian) @ (alpha * force) + zeta_mean
    return Estimates(z, zeta, lam, nu)


def dual_force(problem: Problem, estimates: Estimates) -> np.ndarray:
    """Return grad g_i(z_i)' lambda_i + grad h_i' nu_i of every robot, (n, 4n + 2)."""
    n, rows = problem.network.robots, problem.rows
    z, lam = estimates.z, estimates.lam
    m, z_p, z_xi = z[:, :2], z[:, 2 : 2 + 2 * n].reshape(n, n, 2), z[:, 2 + 2 * n :].reshape(n, n, 2)
    ball = np.concatenate([m[:, None] - z_p, z_xi], axis=1)  # (n, 2n, 2)
    rho = np.sqrt(np.sum(ball**2, axis=(1, 2)))
    pull = np.sum(rows.a * lam, axis=1) / np.where(rho > 0, rho, np.inf)
    weighted = pull[:, None, None] * ball
    push = np.einsum("ir,irc->ic", lam, rows.C) + weighted[:, :n].sum(axis=1)
    force_p, force_xi = -weighted[:, :n], weighted[:, n:].copy()
    own = np.arange(n)
    force_p[own, own] += estimates.nu[:, :2]
    force_xi[own, own] += estimates.nu[:, 2:]
    return np.hstack([push, force_p.reshape(n, -1), force_xi.reshape(n, -1)])
