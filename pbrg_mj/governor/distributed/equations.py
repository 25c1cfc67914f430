"""One communication round in plain NumPy, as the paper writes it: eqs. 16-30, the specification of the compiled rounds.

Every robot sends (z_i, zeta_i) to its neighbours once and then takes one explicit step of the paper's flow. All
functions but the last are about one robot, and take only what this robot knows or receives. With z = (m, z_p, z_xi):

    minimize f_i(z) = delta_i ||r_i - m||^2                                 (19)
    subject to g_i(z) = a rho(z) + C m - d <= 0,                            (20), rows as of (13)
               g_i(z) = a ||x_G(z)|| + C m - d <= 0 in its place, where rows have directions G
               h_i(z) = (z_pi - p_i, z_xii - xi_i) = 0                      (21)

A proximal round is the same of the links, and has the fixed points of the flow. What a robot alone knows it takes
implicitly: cost, and the bend of rho by its proximal operator; multipliers of what is linear see 2 z+ - z.

`rounds` does the same compiled, for all robots at once; tests hold it to this file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.problem.interface import Problem


class LocalProblem(NamedTuple):
    """What robot i alone knows of one tick's problem, with its R_i rows that exist."""

    leads: float  # delta_i, 1.0 for a leader and 0.0 otherwise
    reference: np.ndarray  # (2,) r_i; of no weight unless the robot leads [m]
    state: np.ndarray  # (4,) p_i, xi_i [m]
    pinned: np.ndarray  # (4,) int, where z_i holds the estimates of p_i and xi_i
    a: np.ndarray  # (R_i,)
    C: np.ndarray  # (R_i, 2)
    d: np.ndarray  # (R_i,) [m]
    along: np.ndarray = np.empty((0, 2))  # (R_i, 2) directions G of the rows, or none


class Message(NamedTuple):
    """What a robot hears of a neighbour k in one round."""

    z: np.ndarray  # (4n + 2,)
    zeta: np.ndarray  # (4n + 2,)


class Estimate(NamedTuple):
    """What robot i remembers, multipliers of the rows that exist only."""

    z: np.ndarray  # (4n + 2,)
    zeta: np.ndarray  # (4n + 2,)
    lam: np.ndarray  # (R_i,)
    nu: np.ndarray  # (4,)


def local_problem(problem: Problem, i: int) -> LocalProblem:
    """Return what robot i knows."""
    n, rows = problem.network.robots, problem.rows
    active = rows.active[i]
    return LocalProblem(
        leads=problem.network.leader[i],
        reference=problem.near_references[i],
        state=np.concatenate([problem.p[i], problem.xi[i]]),
        pinned=np.array([2 + 2 * i, 3 + 2 * i, 2 + 2 * n + 2 * i, 3 + 2 * n + 2 * i]),
        a=rows.a[i, active],
        C=rows.C[i, active],
        d=rows.d[i, active],
        along=rows.along[i, active] if len(rows.along) else np.empty((0, 2)),
    )


def radius(z: np.ndarray, G: np.ndarray | None = None) -> float:
    """Return rho(z) = ||(1 (x) m - z_p, z_xi)|| (eqs. 9, 13), or ||x_G(z)||, the same of all components along G."""
    return float(np.linalg.norm(_deviation(z, G)))


def radius_gradient(z: np.ndarray, G: np.ndarray | None = None) -> np.ndarray:
    """Return the radius's gradient, (4n + 2,); at radius 0, the kink, the subgradient 0.

    With G it is (sum_j e_j G, -e_1 G, ..., -e_n G, s_1 G, ..., s_n G) / ||x_G||, e_j = G.(m - z_pj), s_j = G.z_xij.
    """
    n, size = len(z) // 4, radius(z, G)
    to_p, to_xi = np.split(_deviation(z, G) / size if size > 0.0 else np.zeros(4 * n), 2)
    return np.concatenate([to_p.reshape(n, 2).sum(axis=0), -to_p, to_xi])


def _deviation(z: np.ndarray, G: np.ndarray | None) -> np.ndarray:
    n = len(z) // 4
    deviation = np.concatenate([np.tile(z[:2], n) - z[2 : 2 + 2 * n], z[2 + 2 * n :]])
    return deviation if G is None else np.outer(deviation.reshape(-1, 2) @ G, G).reshape(-1)


def cost_gradient(local: LocalProblem, z: np.ndarray) -> np.ndarray:
    """Return grad f_i(z), the phi_i of eq. 25, (4n + 2,)."""
    gradient = np.zeros(len(z))
    gradient[:2] = 2.0 * local.leads * (z[:2] - local.reference)
    return gradient


def inequalities(local: LocalProblem, z: np.ndarray) -> np.ndarray:
    """Return g_i(z), (R_i,) (eqs. 13, 20)."""
    size = np.array([radius(z, G) for G in local.along]) if len(local.along) else radius(z)
    return local.a * size + local.C @ z[:2] - local.d


def inequality_force(local: LocalProblem, z: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Return grad g_i(z)' lambda_i, robot i's part of Gamma lambda (eq. 26), (4n + 2,)."""
    if len(local.along):
        gradients = [radius_gradient(z, G) for G in local.along]
        force = (local.a * lam) @ np.array(gradients)
    else:
        force = (local.a @ lam) * radius_gradient(z)
    force[:2] += local.C.T @ lam
    return force


def equalities(local: LocalProblem, z: np.ndarray) -> np.ndarray:
    """Return h_i(z), (4,) (eq. 21)."""
    return z[local.pinned] - local.state


def equality_force(local: LocalProblem, z: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Return grad h_i(z)' nu_i, robot i's part of Psi nu (eq. 27), (4n + 2,)."""
    force = np.zeros(len(z))
    force[local.pinned] = nu
    return force


def robot_round(local: LocalProblem, own: Estimate, received: Sequence[Message], flow: Flow) -> Estimate:
    """Return robot i's estimate after one round in which it received these messages.

    Two things are not in the paper, whose flow is continuous: a multiplier whose last explicit step would take it below
    0 stops there, as the flow would, and none grows beyond `flow.multiplier_cap`.
    """
    z, zeta, lam, nu = own
    Lz = sum((z - message.z for message in received), np.zeros(len(z)))  # sum_k L_ik z_k
    Lzeta = sum((zeta - message.zeta for message in received), np.zeros(len(z)))  # sum_k L_ik zeta_k
    if flow.proximal:
        target = z - flow.step * (Lz - Lzeta) - flow.step * flow.alpha * equality_force(local, z, nu)
        new_z, new_lam = proximal_step(local, own, target, flow)
        new_nu = nu + flow.step * equalities(local, 2.0 * new_z - z)
        return Estimate(new_z, zeta - flow.step * Lz, new_lam, new_nu)
    force = cost_gradient(local, z) + inequality_force(local, z, lam) + equality_force(local, z, nu)
    g = inequalities(local, z)
    eta = np.where((lam > 0.0) | (g > 0.0), g, 0.0)  # eq. 29
    return Estimate(
        z=z - flow.step * (Lz - Lzeta) - flow.step * flow.alpha * force,  # eq. 25
        zeta=zeta - flow.step * Lz,  # eq. 25
        lam=np.clip(lam + flow.step * eta, 0.0, flow.multiplier_cap),  # eq. 28
        nu=nu + flow.step * equalities(local, z),  # eq. 30
    )


def proximal_step(local: LocalProblem, own: Estimate, target: np.ndarray, flow: Flow) -> tuple[np.ndarray, np.ndarray]:
    """Return z_i+ and lambda_i+ of rows of rho, from where links and pinned states take z_i, `target` (4n + 2,).

    They solve

        z+ = target - step alpha (grad f_i(z+) + (C' lambda, 0, 0) + a'lambda+ grad rho(z+))
        lambda+ = clip(lambda + step (a rho(z+) + C (2 m+ - m) - d), 0, cap)

    The pull of rho draws all of z_p towards m+, and z_xi towards 0, by one share s of their way: s = 1 at the kink. All
    else follows from s, whose one equation is solved by bisection. Raises ValueError for rows that have directions.
    """
    if len(local.along):
        raise ValueError("proximal rounds take rows of rho, without directions")
    n, gain = len(target) // 4, flow.step * flow.alpha
    v_m = target[:2] + gain * (2.0 * local.leads * local.reference - local.C.T @ own.lam)
    v_p, v_xi = target[2 : 2 + 2 * n].reshape(n, 2), target[2 + 2 * n :]
    stiffness = 1.0 + 2.0 * gain * local.leads

    def m(s: float) -> np.ndarray:
        return (v_m + s * v_p.sum(axis=0)) / (stiffness + s * n)

    def distance(s: float) -> float:
        """rho(z+) / (1 - s)."""
        return float(np.sqrt(np.sum((m(s) - v_p) ** 2) + np.sum(v_xi**2)))

    def multipliers(s: float) -> np.ndarray:
        g = local.a * (1.0 - s) * distance(s) + local.C @ (2.0 * m(s) - own.z[:2]) - local.d
        return np.clip(own.lam + flow.step * g, 0.0, flow.multiplier_cap)

    def excess(s: float) -> float:
        return s * distance(s) - gain * float(local.a @ multipliers(s))

    s = _root(excess)
    return np.concatenate([m(s), ((1.0 - s) * v_p + s * m(s)).reshape(-1), (1.0 - s) * v_xi]), multipliers(s)


def _root(excess: Callable[[float], float]) -> float:
    """Return where `excess` turns from - to +: 0 if it is not negative there, 1 if it is not positive at 1."""
    low, high = 0.0, 1.0
    if excess(low) >= 0.0:
        return low
    if excess(high) <= 0.0:
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


def run_rounds(problem: Problem, estimates: Estimates, flow: Flow, rounds: int) -> Estimates:
    """Return the estimates after `rounds` communication rounds in which every message arrives."""
    net = problem.network
    for _ in range(rounds):
        sent = [Message(z, zeta) for z, zeta in zip(estimates.z, estimates.zeta, strict=True)]
        received = [[sent[k] for k in net.neighbours[net.first[i] : net.first[i + 1]]] for i in range(net.robots)]
        estimates = update_robots(problem, estimates, received, flow)
    return estimates


def update_robots(
    problem: Problem, estimates: Estimates, received: Sequence[Sequence[Message]], flow: Flow
) -> Estimates:
    """Return all robots' estimates after one round; robot i received the messages `received[i]`."""
    after = Estimates(*(np.zeros_like(array) for array in estimates))
    for i, active in enumerate(problem.rows.active):
        own = Estimate(estimates.z[i], estimates.zeta[i], estimates.lam[i, active], estimates.nu[i])
        new = robot_round(local_problem(problem, i), own, received[i], flow)
        after.z[i], after.zeta[i], after.lam[i, active], after.nu[i] = new
    return after
