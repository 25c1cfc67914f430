"""Rounds until every robot's m is within 1 cm of the optimum of a problem that stands still, from a cold start.

All robots stand at 0. The last one leads, called to (2, 3); another one knows the line x + y = 3, so that the best m is
(1, 2).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.messaging.program import OwnData, RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, Optimizer, no_rows
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network

REFERENCE = np.array([2.0, 3.0])
NORMAL, OFFSET = np.full(2, np.sqrt(0.5)), 3.0 * np.sqrt(0.5)
BEST = np.array([1.0, 2.0])
CLOSE = 0.01  # [m]
STAYS = 100  # rounds for which all must have stayed within


class Static(NamedTuple):
    """A team, and which of its robots knows the line."""

    network: Network
    owner: int

    def local(self, i: int) -> LocalProblem:
        """Return what robot i knows."""
        leads = bool(self.network.leader[i])
        own = OwnData(0, np.zeros(2), np.zeros(2), 0.0, HalfSpaces.empty(1, 1), REFERENCE if leads else None)
        line = Rows(np.zeros((1, 1)), NORMAL[None, None], np.full((1, 1), OFFSET), np.ones((1, 1), dtype=bool))
        rows = line if i == self.owner else no_rows()
        return LocalProblem(own, own.reference, rows, Spread(float(self.network.robots), np.zeros(2), 0.0))


def facts(team: Network, i: int) -> RobotFacts:
    """Return those of robot i."""
    neighbours = team.neighbours[team.first[i] : team.first[i + 1]]
    return RobotFacts(i, team.robots, tuple(neighbours.tolist()), bool(team.leader[i]))


def ring(n: int, owner: int) -> Static:
    """Return a ring of n robots."""
    return Static(network_of_edges([(i, (i + 1) % n) for i in range(n)], np.eye(n)[-1]), owner)


def grid(rows: int, columns: int) -> Static:
    """Return a grid whose line is known in the corner that is farthest from the leader's."""
    n = rows * columns
    across = [(k, k + 1) for k in range(n) if (k + 1) % columns]
    return Static(network_of_edges([*across, *((k, k + columns) for k in range(n - columns))], np.eye(n)[-1]), 0)


GRAPHS: dict[str, Callable[[], Static]] = {
    "ring of 5": lambda: ring(5, 1),
    "grid of 4 x 5": lambda: grid(4, 5),
    "ring of 20": lambda: ring(20, 9),
}


def rounds_to_agree(optimizer: Optimizer, static: Static, most: int = 5000) -> int | None:
    """Return after how many rounds all m_i are and stay within 1 cm of the optimum; None if that takes too many."""
    team = static.network
    locals_ = [static.local(i) for i in range(team.robots)]
    memories = [optimizer.start(facts(team, i), locals_[i]) for i in range(team.robots)]
    since = None
    for count in range(most):
        off = max(np.linalg.norm(optimizer.candidate(*one) - BEST) for one in zip(locals_, memories, strict=True))
        if not off <= CLOSE:
            since = None
        elif since is None:
            since = count
        if not off < 1e6 or (since is not None and count - since >= STAYS):
            break
        messages = np.array([optimizer.message(memory) for memory in memories])
        received = [messages[team.neighbours[team.first[i] : team.first[i + 1]]] for i in range(team.robots)]
        memories = [optimizer.step_once(*one) for one in zip(locals_, memories, received, strict=True)]
    return since


def rounds_of_paper_flow(flow: Flow, static: Static, most: int) -> int | None:
    """Return the same of the paper's flow in R^(4n + 2), whose optimum is that of eq. 13 for a team that stays at 0."""
    team, n = static.network, static.network.robots
    spaces = HalfSpaces.empty(n, 1)
    spaces.G[static.owner, 0], spaces.h[static.owner, 0] = NORMAL, OFFSET
    spaces.active[static.owner, 0] = spaces.binds[static.owner, 0] = True
    zero = np.zeros((n, 2))
    problem = Problem(team, zero, zero, ball_rows(spaces, zero), REFERENCE)
    best = ClarabelSolver().solve(problem).m
    governor = DistributedGovernor(flow, 1, "zero")
    memory, since, step = governor.init(problem), None, max(1, most // 4000)
    for count in range(0, most, step):
        off = float(np.linalg.norm(memory.estimates.z[:, :2] - best, axis=1).max())
        since = None if not off <= CLOSE else count if since is None else since
        if not off < 1e6 or (since is not None and count - since >= STAYS * step):
            break
        estimates, _, _ = governor.run(problem, memory, step)
        memory = memory._replace(estimates=estimates)
    return since
