"""Runs a program on every robot, round by round, and carries its messages.

Within a round every robot sends. A message sent in round t arrives in round t + delay, at the earliest in the round of
its sending, unless it is lost, or its sender is silent then or its receiver when it arrives. A robot gets the messages
of a round in the order of their sending, ties in the order of their links.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, get_args

import numpy as np

from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts, RobotProgram, TeamConstants
from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.checks.certificate import STATE_DEPENDENT
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Channel, channel
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network

SEVERITY: tuple[Status, ...] = get_args(Status)
"""What a team's status is: the last of its robots' in this order."""


class Packet(NamedTuple):
    """A message under way."""

    arrives: int  # round
    sent: int  # round
    link: int
    content: bytes


class NetworkedMemory(NamedTuple):
    """The robots' memories, and what is under way."""

    robots: tuple[Any, ...]
    packets: tuple[Packet, ...]
    last_arrival: np.ndarray  # (E,) when the message of the round before arrives
    bad: np.ndarray  # (E,) bool: the link was losing messages in the last round
    tick: int


@dataclass(frozen=True)
class NetworkedGovernor:
    """A robot's program on all robots of a team."""

    program: RobotProgram
    rounds: int  # per tick
    channel: Channel | None = None  # None: every message arrives within its round
    constants: TeamConstants | None = None  # told to every robot
    shares_start: bool = False  # every robot knows the first p of all
    shares_rows: bool = False  # every robot is given its own rows; never with rows that are made of the team's states

    @classmethod
    def of(cls, scenario: Scenario, program: RobotProgram) -> NetworkedGovernor:
        """Return a program on all robots of a scenario, with messages on the scenario's network."""
        return cls(
            program=program,
            rounds=scenario.governor.rounds,
            channel=channel(scenario),
            constants=TeamConstants.of(scenario, network(scenario)),
            shares_start=scenario.governor.initial == "start",
            shares_rows=scenario.governor.certificate not in STATE_DEPENDENT,
        )

    def with_ideal_network(self) -> NetworkedGovernor:
        """Return the same programs, prepared for the same network, on one that neither delays nor loses anything."""
        return replace(self, channel=None)

    def init(self, problem: Problem) -> NetworkedMemory:
        """Return the memories before the first tick."""
        team = problem.network
        links = len(team.neighbours)
        start = problem.p if self.shares_start else None
        robots = tuple(
            self.program.start(RobotFacts.of(team, i, self.constants, start), self._own(problem, i, 0))
            for i in range(team.robots)
        )
        never = np.full(links, np.iinfo(np.int64).min)
        return NetworkedMemory(robots, (), never, np.zeros(links, dtype=bool), 0)

    def step(self, problem: Problem, memory: NetworkedMemory) -> tuple[Solution, NetworkedMemory]:
        """Run one tick's rounds; the status is the worst of the robots'."""
        team, program = problem.network, self.program
        n = team.robots
        robots = [program.begin(self._own(problem, i, memory.tick), memory.robots[i]) for i in range(n)]
        first = memory.tick * self.rounds
        links_now = self._conditions(team, memory, first)
        sent, packets = np.zeros(n, dtype=np.int64), list(memory.packets)
        for k in range(self.rounds):
            now = first + k
            for i in range(n):
                outbox, robots[i] = program.send(robots[i])
                for content, link in _addressed(team, i, outbox):
                    if not links_now.silent[k, i]:
                        sent[i] += len(content)
                        if not links_now.lost[k, link]:
                            packets.append(Packet(int(links_now.arrives[k, link]), now, link, content))
            due = sorted((one for one in packets if one.arrives <= now), key=lambda one: (one.sent, one.link))
            packets = [one for one in packets if one.arrives > now]
            for i in range(n):
                inbox = [
                    (int(team.neighbours[one.link]), one.content)
                    for one in due
                    if team.receiver[one.link] == i and not links_now.silent[k, i]
                ]
                robots[i] = program.receive(inbox, robots[i])
        answers: list[RobotAnswer] = []
        for i in range(n):
            answer, robots[i] = program.finish(robots[i])
            answers.append(answer)
        after = NetworkedMemory(tuple(robots), tuple(packets), links_now.arrives[-1], links_now.bad, memory.tick + 1)
        return team_answer(problem, answers, self.rounds, sent), after

    def _own(self, problem: Problem, i: int, tick: int) -> OwnData:
        return own_data(problem, i, tick, rows=self.shares_rows)

    def _conditions(self, team: Network, memory: NetworkedMemory, first: int) -> _LinkConditions:
        rounds, links, n = self.rounds, len(team.neighbours), team.robots
        if self.channel is None:
            arrives = np.repeat(np.arange(first, first + rounds)[:, None], links, axis=1)
            nothing = np.zeros((rounds, links), dtype=bool)
            return _LinkConditions(nothing, arrives, np.zeros((rounds, n), dtype=bool), memory.bad)
        lost = self.channel.lost(memory.bad, first, rounds)
        arrives = self.channel.arrivals(memory.last_arrival, first, rounds)
        return _LinkConditions(lost, arrives, self.channel.silent(first, rounds, n), lost[-1])


class _LinkConditions(NamedTuple):
    """What happens to the messages of one tick's rounds."""

    lost: np.ndarray  # (rounds, E) bool
    arrives: np.ndarray  # (rounds, E) int64 round
    silent: np.ndarray  # (rounds, n) bool
    bad: np.ndarray  # (E,) bool after the last round


def _addressed(team: Network, sender: int, outbox: Any) -> list[tuple[bytes, int]]:
    """Return the messages with the directed links they take. Raises ValueError for one to no neighbour."""
    found = []
    for receiver, content in outbox.items():
        links = [link for link in team.links_to(receiver) if team.neighbours[link] == sender]
        if not links:
            raise ValueError(f"robot {sender + 1} sends to robot {receiver + 1}, which is no neighbour")
        if content:
            found.append((content, links[0]))
    return found


def team_answer(problem: Problem, answers: Sequence[RobotAnswer], rounds: int, sent: np.ndarray) -> Solution:
    """Return what the robots answered, as one; `sent` (n,) are the bytes that they put on their links."""
    multipliers = np.zeros(problem.rows_shape)
    for i, answer in enumerate(answers):
        if answer.multipliers is not None:
            multipliers[i] = answer.multipliers
    return Solution(
        m=np.array([answer.m for answer in answers]),
        multipliers=multipliers,
        status=SEVERITY[max(SEVERITY.index(answer.status) for answer in answers)],
        rounds=rounds,
        bytes_sent=sent,
        lost=np.array([answer.lost for answer in answers], dtype=np.int64),
    )


def own_data(problem: Problem, i: int, tick: int, *, rows: bool = False) -> OwnData:
    """Return what robot i measures, its `rows` if asked for; everything is a copy that nobody else sees."""
    spaces, heading, motion = problem.half_spaces, problem.heading, problem.motion
    if spaces is None or heading is None:
        raise ValueError("a robot's program needs half-spaces and headings in the problem")
    own = slice(i, i + 1)
    return OwnData(
        tick=tick,
        p=problem.p[i].copy(),
        xi=problem.xi[i].copy(),
        heading=float(heading[i]),
        half_spaces=HalfSpaces(
            spaces.G[own].copy(), spaces.h[own].copy(), spaces.active[own].copy(), spaces.binds[own].copy()
        ),
        reference=problem.reference.copy() if problem.network.leader[i] else None,
        rows=Rows(*(array[own].copy() for array in problem.rows)) if rows else None,
        motion=None if motion is None else motion[i].copy(),
    )
