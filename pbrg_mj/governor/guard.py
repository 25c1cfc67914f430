"""A guard behind the optimizer: no robot applies what its team's own rows forbid.

The network's answer lags the moving team, and while nothing is admissible its estimates of the others' states are bent
towards the least violation. The guard is a small reference governor on top, with messages of its own. Once a tick every
robot passes on the freshest (p_j, xi_j, r_j) it has heard of everyone. From the states, robot i finds c_i = mean of
p_j, of all references the one with the smallest rho, and by its own rows alone the largest radius r_i such that every m
with ||m - c_i|| <= r_i satisfies them:

    a sqrt(n r^2 + s^2) + ||C|| r <= d - C c_i,   s^2 = sum ||p_j - c_i||^2 + ||xi||^2

The smallest radius that robot i has heard of bounds what it applies: m_i, moved to within that radius of c_i. Where
even c_i breaks a row (a wall seen late) the radius is 0: the team is called to where it is, and V, which does not grow
under a constant reference, shrinks until the rows hold again.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.distributed.governor import DOUBLE, DistributedGovernor, DistributedMemory
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.kernel import kernel

UNHEARD = 1 << 30  # ticks


@dataclass(frozen=True)
class GuardedMemory:
    """The optimizer's memory, and what the robots have heard of each other."""

    inner: DistributedMemory
    heard: np.ndarray  # (n, n, 5) what robot i has heard of robot j's (p, xi, radius) [m]
    age: np.ndarray  # (n, n) int64 ticks since robot j was so; UNHEARD before any word of it came


@dataclass(frozen=True)
class GuardedGovernor:
    """The distributed governor with a guard on what it applies."""

    inner: DistributedGovernor

    def init(self, problem: Problem) -> GuardedMemory:
        """Return the optimizer's first memory, before any message was received."""
        n = problem.network.robots
        return GuardedMemory(self.inner.init(problem), np.zeros((n, n, 5)), np.full((n, n), UNHEARD, dtype=np.int64))

    def step(self, problem: Problem, memory: GuardedMemory) -> tuple[Solution, GuardedMemory]:
        """Run one tick's rounds, exchange what is known once, and return what each robot may apply.

        The status is `inadmissible` where a robot's rows forbid even its c_i. A robot that has not yet heard of
        everyone, in the first ticks, is not guarded.
        """
        solution, inner = self.inner.step(problem, memory.inner)
        network = problem.network
        unbound = np.column_stack([problem.p, problem.xi, np.full(network.robots, np.inf)])
        heard, age = _gossip(memory.heard, memory.age, unbound, network.first, network.neighbours)
        if solution.status == "diverged":
            return solution, GuardedMemory(inner, heard, age)
        centre = heard[:, :, :2].mean(axis=1)
        knows = (age < UNHEARD).all(axis=1)
        own = np.where(knows, admissible_radii(problem.rows, heard[:, :, :4], centre), np.inf)
        np.fill_diagonal(heard[:, :, 4], np.maximum(own, 0.0))
        way = solution.m - centre
        share = np.minimum(1.0, heard[:, :, 4].min(axis=1) / np.maximum(np.linalg.norm(way, axis=1), 1e-12))
        guarded = dataclasses.replace(
            solution,
            m=np.where(knows[:, None], centre + share[:, None] * way, solution.m),
            status="inadmissible" if np.any(own < 0.0) else solution.status,
            bytes_sent=solution.bytes_sent + DOUBLE * 5 * network.robots * network.degree,
        )
        return guarded, GuardedMemory(inner, heard, age)


def admissible_radii(rows: Rows, states: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return r_i (n,) [m] of every robot; -1 where its rows forbid even c_i, inf where it has none.

    `states` (n, n, 4) are the (p_j, xi_j) that robot i knows of, `centre` (n, 2) its c_i.
    """
    n = len(states)
    s2 = _squares(rows, states[:, :, :2] - centre[:, None]) + _squares(rows, states[:, :, 2:])  # (n, 1) or (n, R)
    slack = rows.d - np.einsum("irc,ic->ir", rows.C, centre)
    a, b = rows.a, np.linalg.norm(rows.C, axis=2)
    # a sqrt(n r^2 + s^2) = slack - b r, squared: (a^2 n - b^2) r^2 + 2 b slack r + a^2 s^2 - slack^2 = 0. With n > 1
    # and ball rows (a = b = 1) or input rows (b = 0) the first coefficient is positive, the larger root the one.
    first, half, last = a**2 * n - b**2, b * slack, a**2 * s2 - slack**2
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.where(first > 0, (-half + np.sqrt(half**2 - first * last)) / first, -last / (2 * half))
    radius = np.where(slack >= a * np.sqrt(s2), root, -1.0)
    return np.where(rows.active, radius, np.inf).min(axis=1, initial=np.inf)


def _squares(rows: Rows, vectors: np.ndarray) -> np.ndarray:
    """Return sum_j ||v_j||^2 of each robot's vectors (n, n, 2), (n, 1); or (n, R) of their parts along the rows."""
    if not len(rows.along):
        return np.sum(vectors**2, axis=(1, 2))[:, None]
    return np.sum((rows.along @ vectors.transpose(0, 2, 1)) ** 2, axis=2)


@kernel
def _gossip(heard, age, own, first, neighbours):
    """Return the freshest that each robot has heard of everyone, and how old it is, after one exchange."""
    n = len(own)
    known, older = heard.copy(), np.minimum(age + 1, UNHEARD)
    for i in range(n):
        for k in neighbours[first[i] : first[i + 1]]:
            for j in range(n):
                if age[k, j] + 1 < older[i, j]:
                    known[i, j], older[i, j] = heard[k, j], age[k, j] + 1
        known[i, i], older[i, i] = own[i], 0
    return known, older
