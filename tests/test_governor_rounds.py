"""A round, compiled and in NumPy, against the paper's equations as matrices, and against what a robot may know."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed import equations
from pbrg_mj.governor.distributed import rounds as compiled
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import run_rounds
from tests.problems import GRAPHS, graph, random_problem

FLOW = Flow(alpha=2.0, step=1e-2)


def random_estimates(rng, rows):
    z = rng.normal(size=(5, 22))
    lam = rng.uniform(0, 1, size=rows.d.shape) * (rng.random(rows.d.shape) < 0.5) * rows.active
    return Estimates(z, rng.normal(size=z.shape), lam, rng.normal(size=(5, 4)))


def rho(z):
    n = (len(z) - 2) // 4
    return np.linalg.norm(np.concatenate([np.tile(z[:2], n) - z[2 : 2 + 2 * n], z[2 + 2 * n :]]))


def finite_difference(function, z, eps=1e-6):
    steps = eps * np.eye(len(z))
    return np.array([(function(z + s) - function(z - s)) / (2 * eps) for s in steps])


def naive_round(problem, e, alpha, step):
    """One explicit Euler step of eqs. 25-30; gradients of f, g and h by finite differences of the functions."""
    net, rows, n = problem.network, problem.rows, problem.network.robots
    L = net.laplacian
    dz, dzeta = -L @ e.z + L @ e.zeta, -L @ e.z
    lam, nu = np.zeros_like(e.lam), e.nu.copy()
    for i in range(n):
        own = np.r_[2 + 2 * i : 4 + 2 * i, 2 + 2 * n + 2 * i : 4 + 2 * n + 2 * i]
        state = np.concatenate([problem.p[i], problem.xi[i]])
        at = np.flatnonzero(rows.active[i])
        a, C, d = rows.a[i, at], rows.C[i, at], rows.d[i, at]

        def lagrangian(z, i=i, own=own, state=state, at=at, a=a, C=C, d=d):
            f = net.leader[i] * np.sum((problem.reference - z[:2]) ** 2)
            return f + e.lam[i, at] @ (a * rho(z) + C @ z[:2] - d) + e.nu[i] @ (z[own] - state)

        dz[i] -= alpha * finite_difference(lagrangian, e.z[i])
        g = a * rho(e.z[i]) + C @ e.z[i, :2] - d
        eta = np.where((e.lam[i, at] > 0) | (g > 0), g, 0.0)
        lam[i, at] = np.maximum(e.lam[i, at] + step * eta, 0.0)
        nu[i] += step * (e.z[i, own] - state)
    return Estimates(e.z + step * dz, e.zeta + step * dzeta, lam, nu)


@pytest.mark.parametrize("backend", [compiled, equations])
@pytest.mark.parametrize("seed", range(20))
def test_one_round_is_one_euler_step_of_the_papers_equations(seed, backend):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, graph(leaders=(1, 4)) if seed % 2 else None)
    before = random_estimates(rng, problem.rows)
    got = backend.run_rounds(problem, before, FLOW, 1)
    want = naive_round(problem, before, alpha=2.0, step=1e-2)
    for one, other in zip(got, want, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9, rtol=0)


def test_many_rounds_are_rounds_one_after_the_other_and_leave_their_input_alone():
    rng = np.random.default_rng(3)
    problem = random_problem(rng)
    start = random_estimates(rng, problem.rows)
    kept = start.z.copy()
    one_by_one = start
    for _ in range(7):
        one_by_one = run_rounds(problem, one_by_one, FLOW, 1)
    at_once = run_rounds(problem, start, FLOW, 7)
    for one, other in zip(at_once, one_by_one, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(start.z, kept)


def hops(network):
    """Graph distance between every two robots, by powers of the adjacency matrix."""
    n = network.robots
    step = network.laplacian != 0  # oneself and one's neighbours
    reach = np.eye(n, dtype=bool)
    distance = np.where(reach, 0, n)
    for k in range(1, n):
        reach = reach @ step
        distance[reach] = np.minimum(distance[reach], k)
    return distance


PRIVATE = {
    "position": lambda p, k: dataclasses.replace(p, p=bumped(p.p, k)),
    "integral": lambda p, k: dataclasses.replace(p, xi=bumped(p.xi, k)),
    "half-space": lambda p, k: dataclasses.replace(p, rows=p.rows._replace(d=bumped(p.rows.d, k, -5.0))),
    "normal": lambda p, k: dataclasses.replace(p, rows=p.rows._replace(C=bumped(p.rows.C, k))),
}


def bumped(array, k, by=0.125):
    out = array.copy()
    out[k] += by
    return out


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("private", PRIVATE)
def test_private_data_travel_one_hop_a_round(name, private):
    """Changing robot k's data leaves robot i bit-identical for as many rounds as their graph distance.

    Two rounds later (one for the multiplier to react, one for the estimate) it has arrived.
    """
    network = graph(GRAPHS[name])
    rng = np.random.default_rng(7)
    walls_everywhere = random_problem(rng, network)
    rows = walls_everywhere.rows._replace(active=np.ones_like(walls_everywhere.rows.active))
    problem = dataclasses.replace(walls_everywhere, rows=rows)
    start = random_estimates(rng, rows)
    start = start._replace(lam=np.full_like(start.lam, 0.5))
    distance = hops(network)
    for k in range(5):
        other = PRIVATE[private](problem, k)
        for rounds in range(1, 7):
            same = run_rounds(problem, start, FLOW, rounds)
            changed = run_rounds(other, start, FLOW, rounds)
            for i in range(5):
                equal = all(np.array_equal(one[i], other[i]) for one, other in zip(same, changed, strict=True))
                if rounds <= distance[i, k]:
                    assert equal, (i, k, rounds)
                if rounds >= distance[i, k] + 2:
                    assert not equal, (i, k, rounds)


def test_only_leaders_hear_the_operator():
    rng = np.random.default_rng(11)
    problem = random_problem(rng)
    start = random_estimates(rng, problem.rows)
    other = dataclasses.replace(problem, reference=problem.reference + 1.0)
    a, b = (run_rounds(x, start, FLOW, 1) for x in (problem, other))
    np.testing.assert_array_equal(a.z[:4], b.z[:4])
    assert np.all(a.z[4, :2] != b.z[4, :2])


def test_robots_are_alike():
    """Renumbering the robots renumbers the answers."""
    rng = np.random.default_rng(5)
    problem = random_problem(rng)
    order = rng.permutation(5)
    network = graph(
        [(int(np.argwhere(order == i)[0, 0]), int(np.argwhere(order == k)[0, 0])) for i, k in GRAPHS["ring"]],
        leaders=(int(np.argwhere(order == 4)[0, 0]),),
    )
    rows = problem.rows
    blocks = np.arange(rows.d.shape[1]).reshape(-1, 5)[:, order].reshape(-1)  # row k * n + j belongs to robot j
    renumbered = dataclasses.replace(
        problem,
        network=network,
        p=problem.p[order],
        xi=problem.xi[order],
        rows=type(rows)(*(getattr(rows, f)[order][:, blocks] for f in ("a", "C", "d", "active"))),
    )
    zero = Estimates(np.zeros((5, 22)), np.zeros((5, 22)), np.zeros_like(rows.d), np.zeros((5, 4)))
    one = run_rounds(problem, zero, FLOW, 500)
    two = run_rounds(renumbered, zero, FLOW, 500)
    np.testing.assert_allclose(two.z[:, :2], one.z[order][:, :2], atol=1e-10)
    np.testing.assert_allclose(two.lam, one.lam[order][:, blocks], atol=1e-10)
