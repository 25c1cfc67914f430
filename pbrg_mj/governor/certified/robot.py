"""The certified governor as the program of one robot.

Time is cut into cycles of C ticks, C long enough for two floods of the network. In its first tick every robot measures
(p_i, xi_i, heading) and floods it with the m it holds; meanwhile nobody changes m. Who knows the state of everyone
predicts the team to the cycle's last tick and floods the verdict of its own half-spaces: of each the normal and the
interval of G.m that it allows from then on. In the last tick a leader that has the verdicts of everyone moves m to the
nearest point to r that all allow. One that has not, holds: holding is admissible, however late or lost messages are.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.decide import AdvanceLimit, next_reference
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.problem.interface import Problem, StateCertificate, Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.network import Network

ITEM = struct.Struct("<BHI")  # kind, robot, cycle
STATE = struct.Struct("<7d")  # p, xi, held m, heading
COUNT = struct.Struct("<B")
INTERVAL = struct.Struct("<4d")  # G, lowest and highest G.m
OF_STATE, OF_VERDICT = 0, 1

FEW = 0.01  # share of items that a link may still lose after all repeats
Key = tuple[int, int]  # kind, robot


def repeats_for(lost: float, lost_again: float) -> int:
    """Return how often an item is passed on where a share `lost` of all messages is lost.

    `lost_again` is the probability that a message is lost after one that was. Once where all repeats would be in vain.
    """
    if lost <= FEW or lost_again == 1.0:
        return 1
    return 2 if lost_again == 0.0 else 1 + math.ceil(math.log(FEW / lost) / math.log(lost_again))


@dataclass(frozen=True)
class CertifiedMemory:
    """What one robot remembers."""

    facts: RobotFacts
    own: OwnData
    held: np.ndarray  # (2,) NaN before the first decision
    cycle: int
    items: dict[Key, bytes]  # of this cycle: what arrived, and its own
    sent: dict[Key, int]  # how often each was passed on
    status: Status


@dataclass(frozen=True)
class CertifiedProgram:
    """What all robots know beforehand."""

    network: Network
    certificate: StateCertificate
    model: TeamModel
    limits: tuple[AdvanceLimit, ...]
    cycle_ticks: int  # C
    repeats: int  # how often every robot passes an item on: more than once where messages are lost

    def start(self, facts: RobotFacts, own: OwnData) -> CertifiedMemory:
        """Return the memory before the first tick."""
        return CertifiedMemory(facts, own, np.full(2, np.nan), -1, {}, {}, "holding")

    def begin(self, own: OwnData, memory: CertifiedMemory) -> CertifiedMemory:
        """Take the measurements; at a cycle's first tick, begin its flood."""
        if own.tick % self.cycle_ticks:
            return replace(memory, own=own)
        cycle, robot = own.tick // self.cycle_ticks, memory.facts.robot
        state = STATE.pack(*own.p, *own.xi, *memory.held, own.heading)
        items = {(OF_STATE, robot): ITEM.pack(OF_STATE, robot, cycle) + state}
        return self._with_verdict(replace(memory, own=own, cycle=cycle, items=items, sent={}))

    def send(self, memory: CertifiedMemory) -> tuple[Mapping[int, bytes], CertifiedMemory]:
        """Pass on what has not been passed on often enough."""
        fresh = [key for key in sorted(memory.items) if memory.sent.get(key, 0) < self.repeats]
        if not fresh:
            return {}, memory
        content = b"".join(memory.items[key] for key in fresh)
        sent = memory.sent | {key: memory.sent.get(key, 0) + 1 for key in fresh}
        return dict.fromkeys(memory.facts.neighbours, content), replace(memory, sent=sent)

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: CertifiedMemory) -> CertifiedMemory:
        """Keep the items of this cycle."""
        found = dict(memory.items)
        for _, content in inbox:
            for key, cycle, item in _items(content):
                if cycle == memory.cycle:
                    found.setdefault(key, item)
        if len(found) == len(memory.items):
            return memory
        return self._with_verdict(replace(memory, items=found))

    def finish(self, memory: CertifiedMemory) -> tuple[RobotAnswer, CertifiedMemory]:
        """Decide in a cycle's last tick, or hold; before the first decision a leader stays where it is."""
        if (memory.own.tick + 1) % self.cycle_ticks == 0:
            memory = self._decided(memory)
        m = memory.own.p if np.isnan(memory.held).any() else memory.held
        return RobotAnswer(m, memory.status), memory

    def _team(self, memory: CertifiedMemory) -> np.ndarray | None:
        """Return p, xi, held m, heading of all robots (n, 7) in the cycle's first tick; None unless all are known."""
        items = [memory.items.get((OF_STATE, robot)) for robot in range(memory.facts.robots)]
        if any(item is None for item in items):
            return None
        return np.array([STATE.unpack_from(item, ITEM.size) for item in items if item is not None])

    def _ahead(self, team: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return p, xi of the team in the cycle's last tick, and the m held till then; first the mean of p."""
        p, xi = np.ascontiguousarray(team[:, 0:2]), np.ascontiguousarray(team[:, 2:4])
        leaders = np.flatnonzero(self.network.leader)
        held = team[leaders[0], 4:6].copy()
        if np.isnan(held).any():
            held = p.mean(axis=0)
        if self.cycle_ticks > 1:
            p, xi = self.model.predicted(p, xi, held, self.cycle_ticks - 1)
        return p, xi, held

    def _with_verdict(self, memory: CertifiedMemory) -> CertifiedMemory:
        """Add the verdict on the robot's own half-spaces once the whole team is known."""
        robot = memory.facts.robot
        if (OF_VERDICT, robot) in memory.items or (team := self._team(memory)) is None:
            return memory
        p, xi, held = self._ahead(team)
        rows = self.certificate.rows_at(memory.own.half_spaces, p, xi, held)
        content = [ITEM.pack(OF_VERDICT, robot, memory.cycle), b""]
        for slot in np.flatnonzero(memory.own.half_spaces.active[0]).tolist():
            high, low = rows.d[0, 2 * slot], -rows.d[0, 2 * slot + 1]
            there = rows.active[0, 2 * slot : 2 * slot + 2]
            bounds = (low if there[1] else -np.inf, high if there[0] else np.inf)
            content.append(INTERVAL.pack(*rows.C[0, 2 * slot], *bounds))
        content[1] = COUNT.pack(len(content) - 2)
        return replace(memory, items=memory.items | {(OF_VERDICT, robot): b"".join(content)})

    def _decided(self, memory: CertifiedMemory) -> CertifiedMemory:
        """Return the memory with the next m, or with the one held and the status `holding`."""
        team, verdicts = self._team(memory), self._verdicts(memory)
        if team is None or verdicts is None:
            return replace(memory, status="holding")
        p, xi, held = self._ahead(team)
        first = np.isnan(memory.held).any() and self.cycle_ticks > 1  # until now leaders stayed, and held no m
        if first or not memory.facts.leads or memory.own.reference is None:
            return replace(memory, held=held, status="ok")
        problem = Problem(self.network, p, xi, verdicts, memory.own.reference, heading=team[:, 6].copy())
        m, admissible = next_reference(problem, held, self.limits)
        return replace(memory, held=m, status="ok" if admissible else "infeasible")

    def _verdicts(self, memory: CertifiedMemory) -> Rows | None:
        """Return the rows of all verdicts (1, R), in the order of owners and slots; None unless all have come."""
        intervals: list[tuple[float, ...]] = []
        for robot in range(memory.facts.robots):
            item = memory.items.get((OF_VERDICT, robot))
            if item is None:
                return None
            intervals += INTERVAL.iter_unpack(item[ITEM.size + COUNT.size :])
        data = np.array(intervals).reshape(-1, 4)
        C, d = np.empty((1, 2 * len(data), 2)), np.empty((1, 2 * len(data)))
        C[0, 0::2], C[0, 1::2] = data[:, :2], -data[:, :2]
        d[0, 0::2], d[0, 1::2] = data[:, 3], -data[:, 2]
        active = np.isfinite(d)
        return Rows(np.zeros(d.shape), C, np.where(active, d, 0.0), active)


def _items(content: bytes) -> list[tuple[Key, int, bytes]]:
    """Return the items of a message: whose, of which cycle, content."""
    found, at = [], 0
    while at < len(content):
        kind, robot, cycle = ITEM.unpack_from(content, at)
        size = ITEM.size
        if kind == OF_STATE:
            size += STATE.size
        else:
            (count,) = COUNT.unpack_from(content, at + ITEM.size)
            size += COUNT.size + count * INTERVAL.size
        found.append(((kind, robot), cycle, content[at : at + size]))
        at += size
    return found
