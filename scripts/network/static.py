"""One static problem on the paper's graph, and how far from its optimum an exchange is after a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.channel import Channel, Loss
from pbrg_mj.team.graph import network_of_edges

RING = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)]
FORMATION = np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])
START = np.array([[-2.0, 0.7], [-1.4, -1.0], [0.2, -1.4], [1.2, -3.0], [0.0, 0.0]])
FLOW = Flow(alpha=2.0, step=5e-3)
FOREVER = 10**9


def problem() -> Problem:
    """Robots frozen at 0.3 of the paper's start offsets, its line x + y = 3, seen by robot 5, r = (2, 3)."""
    walls = HalfSpaces.empty(5, 1)
    walls.G[4, 0], walls.h[4, 0] = np.full(2, np.sqrt(0.5)), 3.0 * np.sqrt(0.5)
    walls.active[4, 0] = walls.binds[4, 0] = True
    network = network_of_edges(RING, np.array([0.0, 0, 0, 0, 1]))
    p = 0.3 * (START - FORMATION)
    return Problem(network, p, np.zeros((5, 2)), ball_rows(walls, FORMATION), np.array([2.0, 3.0]))


def uniform(rounds: int) -> np.ndarray:
    """The same delay on all ten directed links of the ring, in rounds."""
    return np.full(10, rounds)


def uneven(rounds: int) -> np.ndarray:
    """Delays between 0 and twice `rounds`, at least 1, that differ from link to link, the same both ways."""
    shares = {(0, 1): 0.0, (1, 2): 2.0, (2, 3): 0.5, (3, 4): 1.5, (0, 4): 1.0}
    net = problem().network
    ends = zip(np.repeat(np.arange(5), net.degree).tolist(), net.neighbours.tolist(), strict=True)
    return np.array([max(1, round(shares[min(e), max(e)] * rounds)) for e in ends])


def plain(delay: np.ndarray, loss: Loss | None = None, jitter: int = 0) -> Channel:
    """Messages that are estimates."""
    return Channel(delay, 0.0, loss or Loss(), 1, np.zeros((0, 3), np.int64), FOREVER, jitter)


def waves(delay: np.ndarray, impedance: float, loss: Loss | None = None, jitter: int = 0) -> Channel:
    """Messages that are waves, with the reserve that a scenario has by default."""
    messages = plain(delay, loss, jitter)
    return replace(messages, impedance=impedance, reserve=jitter + messages.loss.longest_run())


def distance(channel: Channel, seconds: float, every: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Times [s], and the largest distance of any robot's m from the optimum [m] at them."""
    frozen = problem()
    best = ClarabelSolver().solve(frozen).m
    governor = DistributedGovernor(FLOW, every, "start", channel)
    memory, off = governor.init(frozen), []
    for _ in range(round(seconds / FLOW.step / every)):
        solution, memory = governor.step(frozen, memory)
        off.append(np.linalg.norm(solution.m - best, axis=1).max())
    return FLOW.step * every * np.arange(1, len(off) + 1), np.array(off)
