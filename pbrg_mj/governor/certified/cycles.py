"""The certified governor whose cycles take several ticks, with messages in time, computed for all robots at once.

It does in every tick what `robot.CertifiedProgram` does, bit for bit. In a cycle's first tick it takes the states that
every robot floods, in later ones the half-spaces of those robots that come to know the whole team then, and in the last
one the leaders' decision, which all of them make from the same data.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.flood import COUNT, ITEM
from pbrg_mj.governor.certified.robot import INTERVAL, state_struct
from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.network import Network


class CycleState(NamedTuple):
    """What the robots remember."""

    tick: int
    held: np.ndarray | None  # (2,) by the leaders [m]; None for nothing yet: of several, before their first decision
    known: np.ndarray | None  # (2,) by all others: what leaders held in the cycle before [m]; None in the first cycle
    status: Status
    team: tuple[np.ndarray, np.ndarray, np.ndarray] | None  # as `Problem.prediction_state`, headings: in its first tick
    checked: HalfSpaces | None  # in each robot's rows, those that its verdict is about, as far as there are verdicts


@dataclass(frozen=True)
class CycleGovernor:
    """Leaders move at the end of every cycle towards the nearest certified point to r."""

    network: Network
    model: TeamModel
    decision: CompiledDecision
    rounds: int  # per tick
    cycle_ticks: int  # C, two or more

    def init(self, problem: Problem) -> CycleState:
        """Return the memory before the first tick."""
        leads = problem.network.leader > 0.0
        held = problem.p[leads][0].copy() if np.count_nonzero(leads) == 1 else None  # as `robot.first_held`
        return CycleState(0, held, None, "holding", None, None)

    def step(self, problem: Problem, memory: CycleState) -> tuple[Solution, CycleState]:
        """Return what is held, every robot's own p where it is nothing."""
        n, phase = problem.network.robots, memory.tick % self.cycle_ticks
        if problem.half_spaces is None or problem.heading is None:
            raise ValueError("the certified governor needs half-spaces and headings in the problem")
        if phase == 0:
            team = *problem.prediction_state, np.array(problem.heading)
            memory = memory._replace(team=team, checked=problem.half_spaces)
        elif self._schedule.informed[phase].any():
            memory = memory._replace(
                checked=_taken(memory.checked, problem.half_spaces, self._schedule.informed[phase])
            )
        sent = self._bytes(memory, phase)
        if phase == self.cycle_ticks - 1:
            memory = self._decided(problem, memory)
        m = problem.p.copy()
        leads = problem.network.leader > 0.0
        if memory.held is not None:
            m[leads] = memory.held
        if memory.known is not None:
            m[~leads] = memory.known
        nobody = np.zeros(n, dtype=np.int64)
        solution = Solution(m, np.zeros(problem.rows_shape), memory.status, self.rounds, sent, nobody)
        return solution, memory._replace(tick=memory.tick + 1)

    def _decided(self, problem: Problem, memory: CycleState) -> CycleState:
        """Return the memory with the leaders' next m; where several held nothing, it is the mean of p."""
        if memory.team is None or memory.checked is None:
            raise ValueError("a cycle begins with its first tick")
        p, xi, heading = memory.team
        held = p.mean(axis=0) if memory.held is None else memory.held
        if memory.held is None:
            return memory._replace(held=held, known=held, status="ok")
        p, xi = self.model.predicted(p, xi, held, self.cycle_ticks - 1)
        decided = self.decision.decide(memory.checked, (p, xi, heading), held, problem.reference)
        return memory._replace(held=decided.m[0], known=held, status=decided.status)

    def _bytes(self, memory: CycleState, phase: int) -> np.ndarray:
        """Return what every robot sends to all its neighbours in a tick, (n,)."""
        schedule, intervals = self._schedule, 0 if memory.checked is None else memory.checked.active.sum(axis=1)
        verdict = ITEM.size + COUNT.size + INTERVAL.size * intervals
        state = ITEM.size + state_struct(self.model).size
        sent = schedule.states[phase] * state + schedule.verdicts[phase] @ verdict
        return (self.network.degree * sent).astype(np.int64)

    @cached_property
    def _schedule(self) -> CycleSchedule:
        return CycleSchedule.of(self.network, self.rounds, self.cycle_ticks)


class CycleSchedule(NamedTuple):
    """In which ticks of a cycle robots say what; it depends on the graph alone."""

    informed: np.ndarray  # (C, n) bool: who comes to know the whole team
    states: np.ndarray  # (C, n) how many robots' states a robot passes on
    verdicts: np.ndarray  # (C, n, n) whether robot i passes on the verdict of robot j

    @classmethod
    def of(cls, network: Network, rounds: int, cycle_ticks: int) -> CycleSchedule:
        """Return the schedule of cycles of so many ticks of so many rounds, at least two floods."""
        hops = network.hops
        complete = hops.max(axis=1)  # rounds after which a robot knows every robot, and has its own verdict
        in_tick = np.arange(cycle_ticks)[:, None]
        informed = np.maximum(complete - 1, 0) // rounds == in_tick
        states = (hops // rounds == in_tick[:, :, None]).sum(axis=2)
        verdicts = (complete[None, :] + hops) // rounds == in_tick[:, :, None]
        return cls(informed, states, verdicts)


def _taken(checked: HalfSpaces | None, now: HalfSpaces, robots: np.ndarray) -> HalfSpaces:
    """Return the half-spaces checked so far with those of some robots (n,) bool as they are now."""
    if checked is None or checked is now:
        return now
    return HalfSpaces(
        np.where(robots[:, None, None], now.G, checked.G),
        np.where(robots[:, None], now.h, checked.h),
        np.where(robots[:, None], now.active, checked.active),
        np.where(robots[:, None, None], now.binds, checked.binds),
    )
