"""The certified layer with messages that always arrive within their round, computed for all robots at once.

It does in every tick what `layer.LayerProgram` does in a cycle of one tick: the leaders' m bit for bit, byte for byte.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.scalar_reference_governor import Spread, largest_kappa
from pbrg_mj.governor.certified.consensus import Verdict
from pbrg_mj.governor.certified.flood import COUNT, ITEM
from pbrg_mj.governor.certified.layer import LayerProgram
from pbrg_mj.governor.certified.messages import CANDIDATE, PARTS, ROW, STATE
from pbrg_mj.governor.certified.reference_update import (
    NO_ROWS,
    PredictedTeam,
    reference_update,
    single_leader_reference,
)
from pbrg_mj.governor.messaging.networked import own_data
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, no_rows
from pbrg_mj.governor.optimizers.synchronizer import ITERATION
from pbrg_mj.governor.optimizers.team import TeamOptimizer
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.network import Network


class Schedule(NamedTuple):
    """In which rounds of a tick robots know and send what; it depends on the graph alone."""

    known: np.ndarray  # (n,) after how many rounds a robot knows every state
    rows_sent: np.ndarray  # (n, n) bool: robot i passes on the rows of robot j
    verdicts: np.ndarray  # (n,) how many verdicts a robot sends to each neighbour
    filled: np.ndarray  # (n,) how many rounds have floods or a verdict in its message

    @classmethod
    def of(cls, network: Network, rounds: int) -> Schedule:
        """Return the schedule of ticks of so many rounds."""
        hops = network.hops
        known, n = hops.max(axis=1), network.robots
        masks = [1 << i if known[i] == 0 else 0 for i in range(n)]
        last_sent, verdicts, filled = [0] * n, np.zeros(n, dtype=int), np.zeros(n, dtype=int)
        for k in range(rounds):
            sends = [masks[i] != last_sent[i] for i in range(n)]
            verdicts += sends
            filled += [sends[i] or bool((hops[i] == k).any()) for i in range(n)]
            sent, last_sent = list(masks), list(masks)
            for i in range(n):
                for j in network.neighbours[network.first[i] : network.first[i + 1]]:
                    masks[i] |= sent[j]
                if known[i] == k + 1:
                    masks[i] |= 1 << i
        return cls(known, known[None, :] + hops < rounds, verdicts, filled)


class LayerState(NamedTuple):
    """What the robots remember."""

    held: np.ndarray  # (2,)
    forbidden: bool  # some owner's rows forbade the m held in the last tick
    local: tuple[LocalProblem, ...]
    optimizer: Any


@dataclass(frozen=True)
class LayerGovernor:
    """The layer on all robots; its program has cycles of one tick."""

    layer: LayerProgram
    team: TeamOptimizer
    rounds: int
    schedule: Schedule

    def init(self, problem: Problem) -> LayerState:
        """Return the first held m, the mean of the shifted hand points, and the optimizer's first memory."""
        spread = Spread.of(problem.p, problem.xi)
        local = self._local(problem, [(no_rows(), spread)] * problem.network.robots)
        facts = [_facts(problem, i) for i in range(problem.network.robots)]
        return LayerState(problem.p.mean(axis=0), False, local, self.team.start(problem, facts, local))

    def step(self, problem: Problem, memory: LayerState) -> tuple[Solution, LayerState]:
        """Return this tick's reference: the step kappa to the leader's candidate that all rows allow, or a retreat."""
        n, held, spaces, heading = problem.network.robots, memory.held, problem.half_spaces, problem.heading
        if spaces is None or heading is None:
            raise ValueError("the certified layer needs half-spaces and headings in the problem")
        before = self._local(problem, [(one.rows, one.spread) for one in memory.local])
        leader = int(np.flatnonzero(problem.network.leader)[0])
        found = self.team.candidate(before, memory.optimizer, leader)
        candidate, diverged = self.layer.candidate_or_held(found, held)
        rows = self.layer.certificate.rows_at(spaces, problem.p, problem.xi, held)
        spread = Spread.of(problem.p, problem.xi)
        kappa, allowed = largest_kappa(rows, spread, held, candidate)
        predicted = PredictedTeam(problem.p, problem.xi, heading, held, candidate, memory.forbidden, diverged)
        limiting = NO_ROWS if allowed else rows if memory.forbidden else None
        reference = single_leader_reference(problem.network, before[leader].reference)
        reach = self.layer.reference_range
        m, status = reference_update(predicted, kappa, limiting, self.layer.limits, reference, reach)
        after = self._local(problem, [(_own_rows(rows, i), spread) for i in range(n)])
        solution = Solution(
            m=np.tile(m, (n, 1)),
            multipliers=np.zeros(problem.rows_shape),
            status=status,
            rounds=self.rounds,
            bytes_sent=self._bytes(problem.network, rows if memory.forbidden else None),
        )
        return solution, LayerState(m, not allowed, after, self._optimized(problem, before, after, memory.optimizer))

    def _optimized(
        self, problem: Problem, before: tuple[LocalProblem, ...], after: tuple[LocalProblem, ...], memory: Any
    ) -> Any:
        """Return the optimizer's memory after the tick's rounds; a robot has its new rows once it knows the team."""
        known, done = self.schedule.known, 0
        for at in sorted({int(k) for k in known} | {self.rounds}):
            local = [after[i] if known[i] <= done else before[i] for i in range(len(known))]
            memory = self.team.run(problem, local, memory, at - done)
            done = at
        return memory

    def _local(self, problem: Problem, rows: list[tuple[Rows, Spread]]) -> tuple[LocalProblem, ...]:
        found = []
        for i, (own_rows, spread) in enumerate(rows):
            own = own_data(problem, i, 0)
            reference = problem.near_references[i].copy() if problem.network.leader[i] else None
            found.append(LocalProblem(own, reference, own_rows, spread))
        return tuple(found)

    def _bytes(self, network: Network, asked: Rows | None) -> np.ndarray:
        """Return what every robot sends to all its neighbours, (n,)."""
        n, at, numbers = network.robots, self.schedule, self.layer.optimizer.optimizer.numbers
        sent = np.full(n, n * (ITEM.size + STATE.size) + ITEM.size + CANDIDATE.size)
        sent += at.verdicts * len(Verdict.empty(0).packed(n))
        if numbers:
            sent += self.rounds * (PARTS.size + ITERATION.size + 8 * numbers)
        else:
            sent += at.filled * PARTS.size
        if asked is not None:
            sent += at.rows_sent @ (ITEM.size + COUNT.size + ROW.size * asked.active.sum(axis=1))
        return (network.degree * sent).astype(np.int64)


def _own_rows(rows: Rows, i: int) -> Rows:
    own = slice(i, i + 1)
    return rows._replace(a=rows.a[own], C=rows.C[own], d=rows.d[own], active=rows.active[own])


def _facts(problem: Problem, i: int) -> RobotFacts:
    network = problem.network
    neighbours = network.neighbours[network.first[i] : network.first[i + 1]]
    return RobotFacts(i, network.robots, tuple(neighbours.tolist()), bool(network.leader[i]))
