"""One compiled round in teams of many sizes and degrees, robot by robot, against plain numpy in the same order."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.graph import network_of_edges

FLOW = Flow(alpha=2.0, step=1e-2, multiplier_cap=0.9)
RING = {n: [(j, (j + 1) % n) for j in range(n)] for n in (3, 5, 9, 14, 33)}
CLIQUE_WITH_TAIL = [(i, k) for i in range(6) for k in range(i)] + [(j, j + 1) for j in range(5, 11)]
TEAMS = {
    **{f"ring of {n}": (n, edges) for n, edges in RING.items()},
    "alone": (1, []),
    "pair": (2, [(0, 1)]),
    "clique with a tail and a stray": (13, CLIQUE_WITH_TAIL),  # neighbours: 0, 1, 2, 5 and 6
}


def team(size_and_edges, rng):
    """A problem where every other robot has rows, and estimates; that of robot 2 has rho = 0, the kink."""
    n, edges = size_and_edges
    network = network_of_edges(edges, (np.arange(n) % 3 == 0).astype(float))
    shape, sees = (n, 4), np.arange(n)[:, None] % 2 == 0
    rows = Rows(
        rng.uniform(0, 1, shape), rng.normal(size=(*shape, 2)), rng.normal(size=shape), sees & (rng.random(shape) < 0.8)
    )
    z = rng.normal(size=(n, 4 * n + 2))
    if n > 2:
        z[2] = np.concatenate([np.tile(z[2, :2], n + 1), np.zeros(2 * n)])
    lam = rng.uniform(0, 1, shape) * (rng.random(shape) < 0.5)
    problem = Problem(network, rng.normal(size=(n, 2)), rng.normal(size=(n, 2)), rows, rng.normal(size=2))
    return problem, Estimates(z, rng.normal(size=z.shape), lam, rng.normal(size=(n, 4)))


def plain_robot(problem, e, i):
    """Robot i's rows after one round: eqs. 25-30, gradients in closed form, sums over neighbours in order."""
    net, n, (alpha, step, cap) = problem.network, problem.network.robots, FLOW
    z, m = e.z[i], e.z[i, :2]
    lead = lead_zeta = np.zeros(4 * n + 2)
    for k in net.neighbours[net.first[i] : net.first[i + 1]]:
        lead, lead_zeta = lead + (z - e.z[k]), lead_zeta + (e.zeta[i] - e.zeta[k])
    new_z, new_zeta = z - step * (lead - lead_zeta), e.zeta[i] - step * lead

    at = np.flatnonzero(problem.rows.active[i])
    a, C, d, lam = problem.rows.a[i, at], problem.rows.C[i, at], problem.rows.d[i, at], e.lam[i, at]
    off = np.concatenate([(m - z[2 : 2 + 2 * n].reshape(n, 2)).ravel(), z[2 + 2 * n :]])
    rho = np.linalg.norm(off)
    slope = off / rho if rho > 0 else off  # of rho, by (1 (x) m - z_p, z_xi)
    to_m = slope[: 2 * n].reshape(n, 2).sum(axis=0)
    new_z[:2] -= (
        step * alpha * (2.0 * net.leader[i] * (m - problem.reference) + C.T @ lam) + step * alpha * (a @ lam) * to_m
    )
    new_z[2:] -= step * alpha * (a @ lam) * slope * np.repeat([-1.0, 1.0], 2 * n)
    g = a * rho + C @ m - d
    new_lam = np.zeros_like(e.lam[i])
    new_lam[at] = np.where((lam > 0) | (g > 0), np.clip(lam + step * g, 0.0, cap), 0.0)

    own = np.r_[2 + 2 * i : 4 + 2 * i, 2 + 2 * n + 2 * i : 4 + 2 * n + 2 * i]
    new_z[own] -= step * alpha * e.nu[i]
    return new_z, new_zeta, new_lam, e.nu[i] + step * (z[own] - np.concatenate([problem.p[i], problem.xi[i]]))


@pytest.mark.parametrize("name", TEAMS)
def test_every_robot_takes_its_own_step(name):
    """Whatever its number of neighbours; bit for bit without rows, where no sum over the team's length is taken."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        problem, before = team(TEAMS[name], rng)
        after = run_rounds(problem, before, FLOW, 1)
        for i in range(problem.network.robots):
            for got, want in zip(after, plain_robot(problem, before, i), strict=True):
                tolerance = 1e-13 if problem.rows.active[i].any() else 0.0
                np.testing.assert_allclose(got[i], want, rtol=0, atol=tolerance)


def test_rows_that_vanish_leave_no_multiplier_however_many_rounds():
    rng = np.random.default_rng(9)
    problem, before = team(TEAMS["ring of 5"], rng)
    gone = dataclasses.replace(problem, rows=problem.rows._replace(active=np.zeros((5, 4), dtype=bool)))
    for rounds in (1, 2, 3):
        assert not run_rounds(gone, before, FLOW, rounds).lam.any()
