"""The paper's algorithm (eqs. 16-30) as the program of one robot: the same numbers as `distributed`, as messages.

A robot keeps its own (z_i, zeta_i, lambda_i, nu_i), sends (z_i, zeta_i) to its neighbours in every round, and takes
one step of the flow from its own rows and what it receives. The step is the compiled one of `distributed.rounds`, run
on a team in which nobody else has rows, links or leads; `distributed.equations` writes it out.

Over late links it keeps of every neighbour the message sent last, cuts links on which nothing has come for long, and
holds while a neighbour is lost, by the rules of docs/network.md and of `distributed.network_equations`. One thing
differs: a robot whose own estimates leave all bounds stops by itself, where the compiled team stops as one.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.infeasibility import some_row_is_infeasible
from pbrg_mj.governor.distributed.rounds import check_limits, run_rounds
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.problem.interface import Problem, Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.channel import Channel
from pbrg_mj.team.network import Network

HOPS = struct.Struct("<H")
NUMBER = struct.Struct("<I")  # of the round in which a message was sent, where messages overtake one another


class NeighbourState(NamedTuple):
    """What a robot keeps of one neighbour."""

    z: np.ndarray  # (4n + 2,)
    zeta: np.ndarray  # (4n + 2,)
    hops: int
    age: int  # rounds since it was sent, or since the start while nothing has come
    up: bool  # something has come, and the neighbour does not count as lost


@dataclass(frozen=True)
class PaperMemory:
    """What one robot remembers."""

    facts: RobotFacts
    own: OwnData
    estimate: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # z, zeta (4n + 2,), lambda (R,), nu (4,)
    m: np.ndarray  # (2,) the last within bounds [m]
    received: Mapping[int, NeighbourState]  # by neighbour
    hops: int  # links to the nearest robot that has lost a neighbour; n: none is known
    round: int
    diverged: bool = False


@dataclass(frozen=True)
class PaperProgram:
    """What all robots know beforehand."""

    flow: Flow
    reference_range: float  # [m]
    diverged_beyond: float = math.inf  # [m]
    channel: Channel | None = None  # how late messages may be; None: all arrive within their round
    delays: Mapping[tuple[int, int], int] | None = None  # rounds, by receiver and sender

    @classmethod
    def of(
        cls, flow: Flow, reference_range: float, diverged_beyond: float, network: Network, channel: Channel | None
    ) -> PaperProgram:
        """Return the program on a network whose messages travel by a channel."""
        if channel is None:
            return cls(flow, reference_range, diverged_beyond)
        pairs = zip(network.receiver.tolist(), network.neighbours.tolist(), strict=True)
        delays = dict(zip(pairs, channel.delay.tolist(), strict=True))
        return cls(flow, reference_range, diverged_beyond, channel, delays)

    def start(self, facts: RobotFacts, own: OwnData) -> PaperMemory:
        """Return estimates of zero, or of every robot's first p where it is known."""
        n = facts.robots
        z = np.zeros(4 * n + 2)
        if facts.start is not None:
            z[:2] = own.p
            z[2 : 2 + 2 * n] = facts.start.reshape(-1)
        nothing = NeighbourState(np.zeros_like(z), np.zeros_like(z), n, 0, False)
        estimate = (z, np.zeros_like(z), np.zeros(_rows(own).d.shape[1]), np.zeros(4))
        bounded, _ = self._limits(estimate)
        received = dict.fromkeys(facts.neighbours, nothing)
        return PaperMemory(facts, own, estimate, z[:2].copy(), received, n, 0, not bounded)

    def begin(self, own: OwnData, memory: PaperMemory) -> PaperMemory:
        """Take the measurements."""
        return replace(memory, own=own)

    def send(self, memory: PaperMemory) -> tuple[Mapping[int, bytes], PaperMemory]:
        """Send (z_i, zeta_i), with the hop count and the round's number where the network needs them."""
        if memory.diverged:
            return {}, memory
        header = b""
        if self.channel is not None:
            header = HOPS.pack(memory.hops) + (NUMBER.pack(memory.round) if self.channel.jitter else b"")
        content = header + memory.estimate[0].tobytes() + memory.estimate[1].tobytes()
        return dict.fromkeys(memory.facts.neighbours, content), memory

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: PaperMemory) -> PaperMemory:
        """Keep what was sent last, and take a step of the flow unless a neighbour is lost somewhere."""
        if memory.diverged:
            return memory
        came: dict[int, NeighbourState] = {}
        for sender, content in inbox:
            new = self._read(sender, content, memory)
            if new.age <= came.get(sender, memory.received[sender]).age:
                came[sender] = new
        kept = {k: came.get(k) or self._without_message(k, memory) for k in memory.facts.neighbours}
        hops = self._count_hops(kept, memory)
        estimate = memory.estimate if hops < memory.facts.robots else self._stepped(kept, memory)
        aged = {k: one._replace(age=one.age + 1) for k, one in kept.items()}
        return replace(memory, estimate=estimate, received=aged, hops=hops, round=memory.round + 1)

    def finish(self, memory: PaperMemory) -> tuple[RobotAnswer, PaperMemory]:
        """Apply the own m_i; one that has left all bounds is held at the last within them, for good."""
        bounded, capped = self._limits(memory.estimate)
        diverged = memory.diverged or not bounded
        m = memory.m if diverged else memory.estimate[0][:2].copy()
        status = "diverged" if diverged else self._status(memory, capped)
        lost = sum(
            self._overdue(k, one, memory) > 0 for k, one in memory.received.items()
        )  # they are a round older by now
        return RobotAnswer(m, status, memory.estimate[2], lost), replace(memory, m=m, diverged=diverged)

    def _read(self, sender: int, content: bytes, memory: PaperMemory) -> NeighbourState:
        n, at, age, hops = memory.facts.robots, 0, 0, memory.facts.robots
        if self.channel is not None:
            (hops,), at = HOPS.unpack_from(content), HOPS.size
            age = self._delay(sender, memory)
            if self.channel.jitter:
                (sent,), at = NUMBER.unpack_from(content, at), at + NUMBER.size
                age = memory.round - sent
        z, zeta = np.frombuffer(content, offset=at).reshape(2, 4 * n + 2)
        return NeighbourState(z, zeta, hops, age, True)

    def _delay(self, sender: int, memory: PaperMemory) -> int:
        return 0 if self.delays is None else self.delays[memory.facts.robot, sender]

    def _overdue(self, neighbour: int, one: NeighbourState, memory: PaperMemory) -> int:
        """Return for how many rounds a neighbour has counted as lost; negative while it does not."""
        if self.channel is None:
            return -1
        longest = self._delay(neighbour, memory) + self.channel.jitter
        return one.age - longest - self.channel.silent_after

    def _without_message(self, neighbour: int, memory: PaperMemory) -> NeighbourState:
        """Return what is kept of a neighbour from which nothing new has come; it counts as lost after a while."""
        one = memory.received[neighbour]
        return one._replace(up=one.up and self._overdue(neighbour, one, memory) < 0)

    def _count_hops(self, kept: Mapping[int, NeighbourState], memory: PaperMemory) -> int:
        nearest = memory.facts.robots
        for neighbour, one in kept.items():
            if one.up:
                nearest = min(nearest, one.hops + 1)
            elif self._overdue(neighbour, one, memory) >= 0:
                nearest = 0
        return nearest

    def _stepped(
        self, kept: Mapping[int, NeighbourState], memory: PaperMemory
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return z, zeta, lambda, nu after one round."""
        facts, own = memory.facts, memory.own
        n, i = facts.robots, facts.robot
        before = Estimates(*(_in_team(part, n, i) for part in memory.estimate))
        links = [neighbour for neighbour in facts.neighbours if kept[neighbour].up]
        for neighbour in links:
            before.z[neighbour], before.zeta[neighbour] = kept[neighbour].z, kept[neighbour].zeta
        first = np.where(np.arange(n + 1) > i, len(links), 0)
        leader = _in_team(np.float64(facts.leads), n, i)
        problem = Problem(
            network=Network(np.zeros((n, n)), first, np.array(links, dtype=np.int64), leader),
            p=_in_team(own.p, n, i),
            xi=_in_team(own.xi, n, i),
            rows=_team_rows(own, n, i),
            reference=np.zeros(2) if own.reference is None else own.reference,
            reference_range=self.reference_range,
        )
        z, zeta, lam, nu = run_rounds(problem, before, self.flow, 1)
        return z[i].copy(), zeta[i].copy(), lam[i].copy(), nu[i].copy()

    def _limits(self, estimate: tuple[np.ndarray, ...]) -> tuple[bool, bool]:
        z, lam = estimate[0][None], estimate[2][None]
        return check_limits(z, lam, self.diverged_beyond, self.flow.multiplier_cap)

    def _status(self, memory: PaperMemory, capped: bool) -> Status:
        facts = memory.facts
        if memory.hops < facts.robots:
            return "holding"
        z = _in_team(memory.estimate[0], facts.robots, facts.robot)
        if some_row_is_infeasible(z, *_team_rows(memory.own, facts.robots, facts.robot)):
            return "suspected"
        return "capped" if capped else "ok"


def _rows(own: OwnData) -> Rows:
    if own.rows is None:
        raise ValueError("the paper's program needs the rows of its half-spaces")
    return own.rows


def _in_team(part: np.ndarray | np.float64, robots: int, robot: int) -> np.ndarray:
    """Return an array of all robots, 0 but for the one's own part."""
    whole = np.zeros((robots, *np.shape(part)), dtype=part.dtype)
    whole[robot] = part
    return whole


def _team_rows(own: OwnData, robots: int, robot: int) -> Rows:
    """Return rows of all robots, of which the one's own alone exist."""
    rows = _rows(own)
    along = _in_team(rows.along[0], robots, robot) if len(rows.along) else rows.along
    a, C, d, active = (_in_team(array[0], robots, robot) for array in (rows.a, rows.C, rows.d, rows.active))
    return Rows(a, C, d, active, along)
