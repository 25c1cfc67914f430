"""Problems for the governor's tests: the paper's team, and random ones."""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network

FORMATION = np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])
START = np.array([[-2.0, 0.7], [-1.4, -1.0], [0.2, -1.4], [1.2, -3.0], [0.0, 0.0]])
RING = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]
GRAPHS = {
    "ring": RING,
    "path": [(0, 1), (1, 2), (2, 3), (3, 4)],
    "complete": [(i, k) for i in range(5) for k in range(i + 1, 5)],
    "kite": [(0, 1), (0, 2), (1, 2), (2, 3), (3, 4)],
}


def graph(edges=RING, leaders=(4,), n=5) -> Network:
    leader = np.zeros(n)
    leader[list(leaders)] = 1.0
    return network_of_edges(edges, leader)


def half_spaces(walls, n=5, slots=3) -> HalfSpaces:
    """`walls` are (robot, normal, offset) with normals of any length; each takes the robot's next free slot."""
    spaces = HalfSpaces.empty(n, slots)
    for robot, normal, offset in walls:
        slot = int(spaces.active[robot].sum())
        length = np.linalg.norm(normal)
        spaces.G[robot, slot] = np.asarray(normal) / length
        spaces.h[robot, slot] = offset / length
        spaces.active[robot, slot] = spaces.binds[robot, slot] = True
    return spaces


def problem(walls, p, reference, network=None, xi=None, formation=FORMATION) -> Problem:
    network = graph() if network is None else network
    n = network.robots
    rows = ball_rows(half_spaces(walls, n), formation)
    xi = np.zeros((n, 2)) if xi is None else xi
    return Problem(network, np.asarray(p, float), xi, rows, np.asarray(reference, float))


def random_problem(rng: np.random.Generator, network=None) -> Problem:
    """A team spread over some 20 cm with one to three walls, feasible or not."""
    walls = [
        (int(rng.integers(5)), rng.normal(size=2), float(rng.uniform(0.5, 4.0))) for _ in range(rng.integers(1, 4))
    ]
    p, xi = 0.2 * rng.normal(size=(5, 2)), 0.2 * rng.normal(size=(5, 2))
    return problem(walls, p, 3 * rng.normal(size=2), network, xi)
