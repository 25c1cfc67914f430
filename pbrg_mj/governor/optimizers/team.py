"""An optimizer on all robots of a team at once, where every message arrives within its round.

`StepByRobot` takes the robots' own steps one by one. Of the paper's flow, `CompiledPaperFlow` runs the compiled rounds,
which tests hold to the equations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pbrg_mj.governor.distributed.governor import DistributedGovernor, DistributedMemory
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, Optimizer
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.team.network import Network


class TeamOptimizer(Protocol):
    """An optimizer of all robots; `local` is what each of them knows of the problem."""

    def start(self, problem: Problem, facts: Sequence[RobotFacts], local: Sequence[LocalProblem]) -> Any:
        """Return the memory before the first round."""
        ...

    def run(self, problem: Problem, local: Sequence[LocalProblem], memory: Any, rounds: int) -> Any:
        """Return the memory after some rounds."""
        ...

    def candidate(self, local: Sequence[LocalProblem], memory: Any, robot: int) -> np.ndarray:
        """Return the m (2,) [m] that a robot would apply now."""
        ...


@dataclass(frozen=True)
class StepByRobot:
    """The robots' own steps."""

    optimizer: Optimizer
    network: Network

    def start(self, problem: Problem, facts: Sequence[RobotFacts], local: Sequence[LocalProblem]) -> list[Any]:
        """Return every robot's first memory."""
        return [self.optimizer.start(*one) for one in zip(facts, local, strict=True)]

    def run(self, problem: Problem, local: Sequence[LocalProblem], memory: list[Any], rounds: int) -> list[Any]:
        """Return every robot's memory after some rounds."""
        optimizer, team = self.optimizer, self.network
        if optimizer.numbers == 0:
            return memory
        for _ in range(rounds):
            messages = np.array([optimizer.message(one) for one in memory])
            received = [messages[team.neighbours[team.first[i] : team.first[i + 1]]] for i in range(team.robots)]
            memory = [optimizer.step_once(*one) for one in zip(local, memory, received, strict=True)]
        return memory

    def candidate(self, local: Sequence[LocalProblem], memory: list[Any], robot: int) -> np.ndarray:
        """Return the robot's m."""
        return self.optimizer.candidate(local[robot], memory[robot])


@dataclass(frozen=True)
class CompiledPaperFlow:
    """The compiled rounds of the paper's flow."""

    governor: DistributedGovernor
    certificate: BallCertificate

    def start(self, problem: Problem, facts: Sequence[RobotFacts], local: Sequence[LocalProblem]) -> DistributedMemory:
        """Return the first estimates."""
        return self.governor.init(self._with_ball(problem))

    def run(
        self, problem: Problem, local: Sequence[LocalProblem], memory: DistributedMemory, rounds: int
    ) -> DistributedMemory:
        """Return the estimates after some rounds."""
        estimates, _, _ = self.governor.run(self._with_ball(problem), memory, rounds)
        return memory._replace(estimates=estimates)

    def candidate(self, local: Sequence[LocalProblem], memory: DistributedMemory, robot: int) -> np.ndarray:
        """Return the robot's m."""
        return memory.estimates.z[robot, :2].copy()

    def _with_ball(self, problem: Problem) -> Problem:
        if problem.half_spaces is None:
            raise ValueError("the paper's rows need half-spaces in the problem")
        return dataclasses.replace(problem, rows=self.certificate.rows(problem.half_spaces))
