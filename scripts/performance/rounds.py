"""One round of the distributed algorithm, and how it grows with the team."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import round_arguments, rounds_in_new_arrays
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.graph import network_of_edges
from performance.timing import each_in_turn

TEAMS = (5, 10, 20, 50, 100, 200)
FLOW = Flow(alpha=2.0, step=1e-3)


def ring_problem(n: int, half_spaces: int = 1) -> tuple[Problem, Estimates]:
    """Return a ring of n robots, of which the first sees so many half-spaces, and estimates near the states."""
    rng = np.random.default_rng(n)
    leader = np.zeros(n)
    leader[-1] = 1.0
    network = network_of_edges([(j, (j + 1) % n) for j in range(n)], leader)
    seen = HalfSpaces.empty(n, half_spaces)
    angle = rng.uniform(0, 2 * np.pi, half_spaces)
    seen.G[0], seen.h[0] = np.column_stack([np.cos(angle), np.sin(angle)]), 10.0
    seen.active[0], seen.binds[0] = True, True
    p, xi = rng.normal(size=(2, n, 2))
    problem = Problem(network, p, xi, ball_rows(seen, np.zeros((n, 2))), np.array([1.0, 1.0]))
    z = np.hstack([p, np.tile(p.ravel(), (n, 1)), np.tile(xi.ravel(), (n, 1))])
    return problem, Estimates(z, np.zeros_like(z), np.zeros_like(problem.rows.d), np.zeros((n, 4)))


@dataclass(frozen=True)
class Round:
    """Times of one round [s]."""

    robots: int
    seconds: float
    streaming: float  # reading and writing the bytes that a round has to
    megabytes: float


def round_times() -> list[Round]:
    """Return a round's time on rings with one half-space, beside that of streaming what it reads and writes."""
    return [_round_time(n) for n in TEAMS]


def _round_time(n: int) -> Round:
    problem, estimates = ring_problem(n)
    arguments = round_arguments(problem, estimates, FLOW)
    rounds = max(20, 200_000 // n**2)
    state = np.concatenate([array.ravel() for array in estimates])
    twin = np.empty_like(state)
    short, long, copying = each_in_turn(
        (
            lambda: rounds_in_new_arrays(*arguments, 0),
            lambda: rounds_in_new_arrays(*arguments, rounds),
            lambda: _stream(state, twin, rounds),
        ),
        calls=3,
    )
    return Round(n, (long - short) / rounds, copying / rounds, 2 * state.nbytes / 1e6)


@kernel
def _stream(one, other, rounds):  # pragma: no cover - compiled
    """Read one array and write the other, in turn."""
    for _ in range(rounds):
        for c in range(len(one)):
            other[c] = one[c] + 1.0
        one, other = other, one
