"""The world's side: a governor whose answers come from the robots' processes.

In every tick it hands each robot its measurements and waits until all have answered. A robot that is no more answers
as one that holds: the m of its last answer, silent from then on.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import monotonic
from typing import NamedTuple

import numpy as np

from pbrg_mj.errors import PbrgError
from pbrg_mj.governor.messaging.networked import NetworkedGovernor, own_data, team_answer
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer
from pbrg_mj.governor.problem.interface import Problem, Solution
from pbrg_mj.team.network import Network
from pbrg_mj.text import counted
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.datagrams import (
    WORLD,
    Datagram,
    Kind,
    StartData,
    Traffic,
    own_message,
    read_answer,
    start_message,
)
from pbrg_mj.transport.mailbox import Mailbox

LOG = logging.getLogger("pbrg_mj")
RETRY_PERIOD = 0.5  # [s] after which a robot that has not answered is told again
PARENT_POLL = 0.05  # [s] between looks whether processes are still there
COMPILING = 300.0  # [s] for the first answers: kernels may be compiled
ANSWER_TIMEOUT = 30.0  # [s] for all others


class TeamMemory(NamedTuple):
    """What the world remembers of the robots."""

    tick: int
    answers: tuple[RobotAnswer, ...]  # the last ones


@dataclass
class RobotProcesses:
    """Robots in processes of their own. A run takes it once."""

    governor: NetworkedGovernor  # whose program the processes run
    network: Network
    digest: bytes  # SHA-256 of the scenario, which must be the robots' own
    mailbox: Mailbox
    ended: Callable[[int], str | None] = lambda robot: None  # why the process of a robot is no more; None: it is there
    tick_seconds: float = 0.0
    gone: dict[int, str] = field(default_factory=dict)  # robots that are no more, and why
    traffic: list[Traffic] = field(default_factory=list)  # of every robot at every tick

    def __post_init__(self) -> None:
        """Know nobody yet."""
        self._places: dict[int, Address] = {}

    def wait_for_robots(self, timeout: float = COMPILING) -> None:
        """Wait until all robots have come. Raises PbrgError when one has ended, or `timeout` [s] is over."""
        until = monotonic() + timeout
        while missing := sorted(set(range(self.network.robots)) - set(self._places)):
            for robot in missing:
                if why := self.ended(robot):
                    raise PbrgError(f"robot {robot + 1} has not come: {why}")
            if monotonic() > until:
                names = ", ".join(str(robot + 1) for robot in missing)
                raise PbrgError(f"not connected to {self.mailbox.address} within {timeout:g} s: robots {names}")
            for _ in self._received(PARENT_POLL):
                pass

    def init(self, problem: Problem) -> TeamMemory:
        """Have all robots come and start. Raises PbrgError when one does not come or cannot start."""
        n = problem.network.robots
        self.wait_for_robots()
        self._await(set(range(n)), Kind.READY, 0, lambda robot: self._start(problem, robot), COMPILING)
        if self.gone:
            robot, why = min(self.gone.items())
            raise PbrgError(f"robot {robot + 1} has not started: {why}")
        held = tuple(RobotAnswer(problem.p[robot].copy(), "holding") for robot in range(n))
        return TeamMemory(0, held)

    def step(self, problem: Problem, memory: TeamMemory) -> tuple[Solution, TeamMemory]:
        """Return what the robots answer. Raises PbrgError when a robot's program fails."""
        n, tick = problem.network.robots, memory.tick
        asked = {robot: own_message(self._own(problem, robot, tick)) for robot in range(n) if robot not in self.gone}
        timeout = ANSWER_TIMEOUT if tick else COMPILING
        came = self._await(
            set(asked), Kind.ANSWER, tick, lambda robot: Datagram(Kind.OWN, WORLD, tick, body=asked[robot]), timeout
        )
        answers, sent = list(memory.answers), np.zeros(n, dtype=np.int64)
        for robot in range(n):
            if robot in came:
                answers[robot], traffic = _answer(came[robot], problem.rows_shape[1])
                sent[robot] = traffic.bytes_sent
                self.traffic.append(traffic)
            else:
                answers[robot] = memory.answers[robot]._replace(status="holding")
        return team_answer(problem, answers, self.governor.rounds, sent), TeamMemory(tick + 1, tuple(answers))

    def traffic_line(self) -> str:
        """Return in words what came and went between the robots."""
        received, missed, timed = (
            sum(getattr(one, name) for one in self.traffic) for name in ("received", "missed", "timed")
        )
        total, largest = (
            sum(one.delay_sum_ns for one in self.traffic),
            max((one.delay_max_ns for one in self.traffic), default=0),
        )
        line = f"messages between the robots' processes: {received} came, {missed} were missed; delay "
        if not timed:
            return line + "unknown between machines"
        of = "" if timed == received else f" of the {timed} within a machine"
        return line + f"{total / timed / 1e3:.0f} us in the mean, {largest / 1e3:.0f} us at most{of}"

    def stop(self) -> None:
        """Tell all robots that the run is over, also those that have yet to be greeted, and let go of the port."""
        until = monotonic() + RETRY_PERIOD
        while len(self._places) < self.network.robots and (left := until - monotonic()) > 0.0:
            if (came := self.mailbox.receive(left)) and self._greets(came[0]):
                self._places[came[0].robot] = came[1]
        for place in self._places.values():
            self.mailbox.send(place, Datagram(Kind.STOP, WORLD))
        self.mailbox.close()

    def _start(self, problem: Problem, robot: int) -> Datagram:
        own, first = self._own(problem, robot, 0), problem.p if self.governor.shares_start else None
        neighbours = problem.network.neighbours[problem.network.first[robot] : problem.network.first[robot + 1]]
        places = {other: self._places[other] for other in (robot, *neighbours.tolist())}
        return Datagram(Kind.START, WORLD, body=start_message(StartData(places, first, own)))

    def _own(self, problem: Problem, robot: int, tick: int) -> OwnData:
        return own_data(problem, robot, tick, rows=self.governor.shares_rows)

    def _await(
        self, asked: set[int], kind: Kind, tick: int, ask: Callable[[int], Datagram | None], timeout: float
    ) -> dict[int, Datagram]:
        """Ask robots until all have answered; return the answers of those that are still there."""
        came: dict[int, Datagram] = {}
        until, again = monotonic() + timeout, 0.0
        while waiting := asked - set(came) - set(self.gone):
            if monotonic() >= again:
                for robot, one in ((robot, ask(robot)) for robot in waiting):
                    if one is not None:
                        self.mailbox.send(self._places[robot], one)
                again = monotonic() + RETRY_PERIOD
            for one in self._received(PARENT_POLL):
                if one.robot in waiting and (one.kind, one.tick) == (kind, tick):
                    came[one.robot] = one
            for robot in sorted(waiting - set(came)):
                if why := self.ended(robot):
                    self._mark_lost(robot, why, tick)
                elif monotonic() > until:
                    self._mark_lost(robot, f"no answer for {timeout:g} s", tick)
        return came

    def _received(self, timeout: float) -> Iterator[Datagram]:
        """Yield what has come from robots that are known; a greeting makes a robot known."""
        while came := self.mailbox.receive(timeout):
            one, place = came
            if self._greets(one) and one.robot not in self._places:
                if one.body != self.digest:
                    self.mailbox.send(place, Datagram(Kind.STOP, WORLD))
                    raise PbrgError(f"robot {one.robot + 1} has another scenario than the world")
                self._places[one.robot] = place
            if self._places.get(one.robot) != place:
                return
            if one.kind is Kind.HELLO:  # the others may take longer than it waits for a world
                self.mailbox.send(place, Datagram(Kind.HELLO, WORLD, body=b""))
            if one.kind is Kind.FAILED:
                raise PbrgError(f"robot {one.robot + 1}: {' '.join(one.body.split())}")
            yield one
            timeout = 0.0

    def _greets(self, one: Datagram) -> bool:
        return one.kind is Kind.HELLO and 0 <= one.robot < self.network.robots

    def _mark_lost(self, robot: int, why: str, tick: int) -> None:
        self.gone[robot] = why
        time = tick * self.tick_seconds
        LOG.warning(
            "robot %d is lost at t = %.2f s: %s; it sends nothing and holds its m from then on", robot + 1, time, why
        )
        for other, place in self._places.items():
            gone = Datagram(Kind.STOP, WORLD) if other == robot else Datagram(Kind.GONE, WORLD, tick, body=robot)
            self.mailbox.send(place, gone)


def _answer(one: Datagram, rows: int) -> tuple[RobotAnswer, Traffic]:
    """Return what a robot answers. Raises PbrgError when it is no answer: robots may run other code."""
    try:
        answer, traffic = read_answer(one.body)
        if not np.isfinite(answer.m).all():
            raise ValueError("m is not finite")
        if answer.multipliers is not None and len(answer.multipliers) != rows:
            raise ValueError(f"{counted(len(answer.multipliers), 'multiplier')} for {counted(rows, 'row')}")
    except ValueError as error:
        raise PbrgError(f"robot {one.robot + 1}'s answer at tick {one.tick} is none: {error}") from None
    return answer, traffic
