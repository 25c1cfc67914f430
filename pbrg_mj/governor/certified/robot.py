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
from functools import cached_property

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.decide import AdvanceLimit, next_reference
from pbrg_mj.governor.certified.flood import COUNT, Flood, ItemSize
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.problem.interface import Problem, StateCertificate, Status
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.network import Network

STATE = "<7d"  # p, xi, held m, heading; with motors the motion behind them
INTERVAL = struct.Struct("<5d")  # G and h, which velocity filters need too; lowest and highest G.m
OF_STATE, OF_VERDICT = 0, 1

LOST_ITEM_SHARE = 0.01  # share of items that a link may still lose after all repeats


def repeats_for(lost: float, lost_again: float) -> int:
    """Return how often an item is passed on where a share `lost` of all messages is lost.

    `lost_again` is the probability that a message is lost after one that was. Once where all repeats would be in vain.
    """
    if lost <= LOST_ITEM_SHARE or lost_again == 1.0:
        return 1
    return 2 if lost_again == 0.0 else 1 + math.ceil(math.log(LOST_ITEM_SHARE / lost) / math.log(lost_again))


def state_struct(model: TeamModel) -> struct.Struct:
    """Return what a robot floods of itself: p, xi, held m, heading, and the pairs of its motion."""
    return struct.Struct(f"{STATE}{2 * model.motion_length}d")


def first_held(network: Network, cycle_ticks: int, facts: RobotFacts, own: OwnData) -> np.ndarray:
    """Return what a robot holds until it has decided (2,) [m], NaN for nothing.

    A single leader holds its first p, so every robot can predict the first cycle's end. Several would hold several.
    """
    alone = facts.leads and np.count_nonzero(network.leader) == 1 and cycle_ticks > 1
    return own.p.copy() if alone else np.full(2, np.nan)


@dataclass(frozen=True)
class CertifiedMemory:
    """What one robot remembers."""

    facts: RobotFacts
    own: OwnData
    held: np.ndarray  # (2,) NaN before the first decision
    flood: Flood
    status: Status


@dataclass(frozen=True)
class CertifiedProgram:
    """What all robots know beforehand."""

    network: Network
    certificate: StateCertificate
    model: TeamModel
    limits: tuple[AdvanceLimit, ...]
    reach: float  # of a retreat [m]
    cycle_ticks: int  # C
    repeats: int  # how often every robot passes an item on: more than once where messages are lost
    farthest: float = math.inf  # that r may be from the mean of p [m]

    @cached_property
    def state(self) -> struct.Struct:
        """What a robot floods of itself."""
        return state_struct(self.model)

    @cached_property
    def sizes(self) -> dict[int, ItemSize]:
        """Of both kinds of items."""
        return {OF_STATE: ItemSize(self.state.size), OF_VERDICT: ItemSize(0, INTERVAL.size)}

    def start(self, facts: RobotFacts, own: OwnData) -> CertifiedMemory:
        """Return the memory before the first tick."""
        held = first_held(self.network, self.cycle_ticks, facts, own)
        return CertifiedMemory(facts, own, held, Flood.begin(-1), "holding")

    def begin(self, own: OwnData, memory: CertifiedMemory) -> CertifiedMemory:
        """Take the measurements; at a cycle's first tick, begin its flood."""
        if own.tick % self.cycle_ticks:
            return replace(memory, own=own)
        motion = () if own.motion is None else own.motion.ravel()
        state = self.state.pack(*own.p, *own.xi, *memory.held, own.heading, *motion)
        flood = Flood.begin(own.tick // self.cycle_ticks).with_item(OF_STATE, memory.facts.robot, state)
        return self._with_verdict(replace(memory, own=own, flood=flood))

    def send(self, memory: CertifiedMemory) -> tuple[Mapping[int, bytes], CertifiedMemory]:
        """Pass on what has not been passed on often enough."""
        content, flood = memory.flood.forwarded(self.repeats)
        return dict.fromkeys(memory.facts.neighbours, content), replace(memory, flood=flood)

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: CertifiedMemory) -> CertifiedMemory:
        """Keep the items of this cycle."""
        flood = memory.flood.received((content for _, content in inbox), self.sizes)
        return memory if flood is memory.flood else self._with_verdict(replace(memory, flood=flood))

    def finish(self, memory: CertifiedMemory) -> tuple[RobotAnswer, CertifiedMemory]:
        """Decide in a cycle's last tick, or hold; before the first decision a leader stays where it is."""
        if (memory.own.tick + 1) % self.cycle_ticks == 0:
            memory = self._decided(memory)
        m = memory.own.p if np.isnan(memory.held).any() else memory.held
        return RobotAnswer(m, memory.status), memory

    def _team(self, memory: CertifiedMemory) -> np.ndarray | None:
        """Return p, xi, held m, heading and motion of all robots (n, 7 + 2 motion_length) in the cycle's first tick.

        None unless all are known.
        """
        states = memory.flood.contents(OF_STATE, memory.facts.robots)
        return None if states is None else np.array([self.state.unpack(state) for state in states])

    def _predicted(self, team: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the team's state in the cycle's last tick, as for rows, and the m held till then; first the mean."""
        motion = team[:, 7:].reshape(len(team), -1, 2) if self.model.motion_length else None
        p, xi = np.ascontiguousarray(team[:, 0:2]), np.ascontiguousarray(team[:, 2:4])
        p, xi = prediction_state(p, xi, motion)
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
        if memory.flood.content(OF_VERDICT, robot) is not None or (team := self._team(memory)) is None:
            return memory
        p, xi, held = self._predicted(team)
        rows = self.certificate.rows_at(memory.own.half_spaces, p, xi, held)
        intervals, h = [], memory.own.half_spaces.h[0]
        for slot in np.flatnonzero(memory.own.half_spaces.active[0]).tolist():
            high, low = rows.d[0, 2 * slot], -rows.d[0, 2 * slot + 1]
            there = rows.active[0, 2 * slot : 2 * slot + 2]
            bounds = (low if there[1] else -np.inf, high if there[0] else np.inf)
            intervals.append(INTERVAL.pack(*rows.C[0, 2 * slot], h[slot], *bounds))
        verdict = COUNT.pack(len(intervals)) + b"".join(intervals)
        return replace(memory, flood=memory.flood.with_item(OF_VERDICT, robot, verdict))

    def _decided(self, memory: CertifiedMemory) -> CertifiedMemory:
        """Return the memory with the next m, or with the one held and the status `holding`."""
        team, verdicts = self._team(memory), self._verdicts(memory)
        if team is None or verdicts is None:
            return replace(memory, status="holding")
        p, xi, held = self._predicted(team)
        first = np.isnan(memory.held).any() and self.cycle_ticks > 1  # until now leaders stayed, and held no m
        if first or not memory.facts.leads or memory.own.reference is None:
            return replace(memory, held=held, status="ok")
        problem = Problem(self.network, p, xi, verdicts, memory.own.reference, heading=team[:, 6].copy())
        m, status = next_reference(problem, held, self.limits, self.reach, self.farthest)
        return replace(memory, held=m, status=status)

    def _verdicts(self, memory: CertifiedMemory) -> Rows | None:
        """Return the rows of all verdicts (1, R), in the order of owners and slots; None unless all have come."""
        verdicts = memory.flood.contents(OF_VERDICT, memory.facts.robots)
        if verdicts is None:
            return None
        intervals = [one for verdict in verdicts for one in INTERVAL.iter_unpack(verdict[COUNT.size :])]
        data = np.array(intervals).reshape(-1, 5)
        C, d = np.empty((1, 2 * len(data), 2)), np.empty((1, 2 * len(data)))
        C[0, 0::2], C[0, 1::2] = data[:, :2], -data[:, :2]
        d[0, 0::2], d[0, 1::2] = data[:, 4], -data[:, 3]
        active = np.isfinite(d)
        return Rows(np.zeros(d.shape), C, np.where(active, d, 0.0), active)
