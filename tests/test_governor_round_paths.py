"""One compiled round in teams of many sizes and degrees, robot by robot, against the equations in plain NumPy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed import equations
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


@pytest.mark.parametrize("name", TEAMS)
def test_every_robot_takes_its_own_step(name):
    """Whatever its number of neighbours; bit for bit without rows, where no sum over the team's length is taken."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        problem, before = team(TEAMS[name], rng)
        after, specified = run_rounds(problem, before, FLOW, 1), equations.run_rounds(problem, before, FLOW, 1)
        for i in range(problem.network.robots):
            for got, want in zip(after, specified, strict=True):
                tolerance = 1e-13 if problem.rows.active[i].any() else 0.0
                np.testing.assert_allclose(got[i], want[i], rtol=0, atol=tolerance)


def test_rows_that_vanish_leave_no_multiplier_however_many_rounds():
    rng = np.random.default_rng(9)
    problem, before = team(TEAMS["ring of 5"], rng)
    gone = dataclasses.replace(problem, rows=problem.rows._replace(active=np.zeros((5, 4), dtype=bool)))
    for rounds in (1, 2, 3):
        assert not run_rounds(gone, before, FLOW, rounds).lam.any()
