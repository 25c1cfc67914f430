"""The rollout governor where messages always arrive within their round, computed for all robots at once.

It does what `robot.RolloutProgram` does, bit for bit, as early as possible: a cycle is computed in its first tick, its
bytes are counted in the ticks in which they are sent, and the leaders move m in its last one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.governor.rollout.messages import HalfSpace, Key, own_half_spaces
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.team import Cycle, run_cycle
from pbrg_mj.governor.rollout.verdicts import advance


class TeamMemory(NamedTuple):
    """What all robots remember."""

    tick: int
    first: np.ndarray  # (n, 2) p at the start, where leaders stay until the first decision
    held: np.ndarray  # (2,) m of the leaders; NaN before
    known: np.ndarray  # (2,) m that followers have last heard of; likewise
    response: np.ndarray | None  # s (T + 1, n); None before it is known
    cycle: Cycle | None  # the present one; None before the first tick
    status: Status


class RolloutGovernor(NamedTuple):
    """Leaders move m by what every robot has rolled out and allowed."""

    plan: RolloutPlan
    rounds: int  # per tick

    def init(self, problem: Problem) -> TeamMemory:
        """Return the memory before the first tick."""
        nowhere = np.full(2, np.nan)
        return TeamMemory(0, problem.p.copy(), nowhere, nowhere, None, None, "holding")

    def step(self, problem: Problem, memory: TeamMemory) -> tuple[Solution, TeamMemory]:
        """Return this tick's references; `holding` until the first decision, `infeasible` where none is admissible."""
        index = memory.tick % self.plan.cycle_ticks
        cycle = memory.cycle
        if index == 0 or cycle is None:
            state, half_spaces = (problem.p, problem.xi), _half_spaces(problem)
            cycle = run_cycle(self.plan, problem.network.arrays, state, memory.held, half_spaces, memory.response)
        memory = memory._replace(cycle=cycle)
        if index == self.plan.cycle_ticks - 1:
            memory = _decided(problem, memory, cycle, self.plan)
        leads = (problem.network.leader > 0.0)[:, None]
        m = np.where(leads, memory.held, memory.known)
        solution = Solution(
            m=np.where(np.isnan(m), memory.first, m),
            multipliers=np.zeros(problem.rows_shape),
            status=memory.status,
            rounds=self.rounds,
            bytes_sent=cycle.bytes_sent[index * self.rounds : (index + 1) * self.rounds].sum(axis=0),
        )
        return solution, memory._replace(tick=memory.tick + 1)


def _half_spaces(problem: Problem) -> dict[Key, HalfSpace]:
    spaces = problem.half_spaces
    if spaces is None:
        raise ValueError("the rollout governor needs half-spaces in the problem")
    owners = np.flatnonzero(spaces.active.any(axis=1)).tolist()
    return {key: one for robot in owners for key, one in own_half_spaces(spaces, robot, robot).items()}


def _decided(problem: Problem, memory: TeamMemory, cycle: Cycle, plan: RolloutPlan) -> TeamMemory:
    if cycle.verdicts is None:
        centre = cycle.summary.centre
        return memory._replace(held=centre, known=centre, response=cycle.response, status="ok")
    team = cycle.summary.centre - memory.held
    moved, status = advance(problem.reference - memory.held, cycle.verdicts, team, plan.reach, plan.farthest)
    return memory._replace(held=memory.held + moved, known=memory.held, status=status)
