"""How far the reference is from the optimum of the moment while the paper's team drives, in the ideal plant.

The run is `paper/simulation_inadmissible` with the line known to robot 2 while robot 5 leads, and predictive rows. The
gap of a tick is the distance of what the leader applies from the nearest point to r that all rows allow in that tick's
state. It is averaged over the first 20 s, in which the team is under way.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.certificate.evaluate import VIOLATED, rows_of_model, worst_rows
from pbrg_mj.governor.certificate.nearest import nearest_admissible
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.messaging.networked import own_data
from pbrg_mj.governor.optimizers.interface import LocalProblem, Optimizer
from pbrg_mj.governor.optimizers.team import StepByRobot
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.interface import Governor, Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from scripts.agreement.static import facts

SECONDS = 20.0
NAME = "paper/simulation_inadmissible"
KEYS = ("governor.kind=certified", "reference.solver=none", "estimator.given.0.robot=2")


class Moving(NamedTuple):
    """What came of a run."""

    gap: float  # mean [m]
    violated: float  # share of ticks in which the predictive certificate does not hold at what was applied
    sent: float  # mean of all robots [bytes a tick]


class Applied:
    """A governor's answer."""

    def __init__(self, governor: Governor) -> None:
        self.governor, self.memory = governor, None

    def __call__(self, problem: Problem) -> tuple[np.ndarray, float]:
        """Return the leader's m of a tick, and what a robot sent."""
        if self.memory is None:
            self.memory = self.governor.init(problem)
        solution, self.memory = self.governor.step(problem, self.memory)
        return solution.m[4], float(solution.bytes_sent.mean())


class Course:
    """The run, whatever moves the reference."""

    def __init__(self, *keys: str) -> None:
        self.scenario: Scenario = load_scenario(NAME, [*KEYS, *keys]).scenario
        self.team, self.model = network(self.scenario), TeamModel.of_scenario(self.scenario)
        self.certificate = PredictiveCertificate.of(self.scenario, 0.0)
        self.formation = np.array(self.scenario.team.formation)
        given = self.scenario.estimator.given[0]
        self.spaces, normal = HalfSpaces.empty(5, 1), np.array(given.normal)
        self.spaces.G[1, 0] = normal / np.linalg.norm(normal)
        self.spaces.h[1, 0] = given.offset / np.linalg.norm(normal)
        self.spaces.active[1, 0] = self.spaces.binds[1, 0] = True
        self.reference = np.array(self.scenario.operator.reference)

    def problem(self, p: np.ndarray, xi: np.ndarray, rows: Rows) -> Problem:
        """Return a tick's problem."""
        return Problem(self.team, p, xi, rows, self.reference, self.spaces, np.zeros(5), 5.0)

    def run(self, apply: Applied) -> Moving:
        """Drive the team by what is applied."""
        one, E = self.spaces, rows_of_model(self.model)
        spaces = HalfSpaces(one.G[None], one.h[None], one.active[None], one.binds[None])
        p, xi = np.array(self.scenario.team.start)[:, :2] - self.formation, np.zeros((5, 2))
        m, gaps, violated, sent = p.mean(axis=0), [], [], []
        for _ in range(round(SECONDS / self.model.tick)):
            rows = self.certificate.rows_at(self.spaces, p, xi, m)
            m, bytes_sent = apply(self.problem(p, xi, rows))
            best, _ = nearest_admissible(rows, Spread.of(p, xi), self.reference)
            gaps.append(float(np.linalg.norm(m - best)))
            states = p[None], xi[None], m[None, None]
            violated.append(worst_rows(spaces, states, self.formation, E)[0, 2] > VIOLATED)
            sent.append(bytes_sent)
            p, xi = self.model.predicted(p, xi, m, 1)
        return Moving(float(np.mean(gaps)), float(np.mean(violated)), float(np.mean(sent)))


class Unverified(Applied):
    """An optimizer's answer as it is; owners of half-spaces know every robot's state."""

    def __init__(self, optimizer: Optimizer, course: Course, rounds: int) -> None:
        self.every, self.rounds, self.memory = StepByRobot(optimizer, course.team), rounds, None

    def __call__(self, problem: Problem) -> tuple[np.ndarray, float]:
        """Return the leader's m of a tick, and what a robot sent."""
        spread, team, rows = Spread.of(problem.p, problem.xi), problem.network, problem.rows
        local = []
        for i in range(team.robots):
            own, mine = own_data(problem, i, 0), slice(i, i + 1)
            kept = rows._replace(a=rows.a[mine], C=rows.C[mine], d=rows.d[mine], active=rows.active[mine])
            local.append(LocalProblem(own, own.reference, kept, spread))
        if self.memory is None:
            self.memory = self.every.start(problem, [facts(team, i) for i in range(team.robots)], local)
        self.memory = self.every.run(problem, local, self.memory, self.rounds)
        sent = 8.0 * self.every.optimizer.numbers * self.rounds * float(team.degree.mean())
        return self.every.candidate(local, self.memory, 4), sent


class PaperFlow(Applied):
    """The paper's algorithm with its own rows (eq. 13)."""

    def __init__(self, flow: Flow, rounds: int, course: Course) -> None:
        super().__init__(DistributedGovernor(flow, rounds, "zero"))
        self.course = course

    def __call__(self, problem: Problem) -> tuple[np.ndarray, float]:
        """Return the leader's m of a tick, and what a robot sent."""
        return super().__call__(replace(problem, rows=ball_rows(self.course.spaces, self.course.formation)))


def certified(*keys: str) -> Moving:
    """Return what comes of the certified governor with some keys of the scenario."""
    course = Course(*keys)
    return course.run(Applied(governor(course.scenario)))
