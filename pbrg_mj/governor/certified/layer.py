"""The certified layer over any optimizer, as the program of one robot: apply only what all robots have verified.

Time is cut into cycles as in `robot`. In a cycle's first tick every robot floods its state, and the first leader what
its optimizer says by then, the candidate m_c. Who knows the state of everyone predicts the team to the cycle's last
tick and finds, by its own rows, the largest step kappa_i from the held m to m_c, as a scalar reference governor does.
The smallest of all is agreed on (`consensus`), and in the last tick all leaders move by it. A leader that lacks a
verdict holds. Rows stay with their owners, but for one case: where some robot's forbid even the held m, all owners
flood theirs in the next cycle, and leaders that have them all retreat to the nearest m that they allow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pbrg_mj.governor.certificate.scalar_reference_governor import Spread, largest_kappa
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.consensus import Verdict
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.governor.certified.flood import Flood
from pbrg_mj.governor.certified.messages import (
    CANDIDATE,
    OF_CANDIDATE,
    OF_ROWS,
    OF_STATE,
    SIZES,
    STATE,
    packed_parts,
    packed_rows,
    unpacked_parts,
    unpacked_rows,
)
from pbrg_mj.governor.certified.reference_update import (
    NO_ROWS,
    PredictedTeam,
    optimizer_status,
    reference_update,
    single_leader_reference,
)
from pbrg_mj.governor.certified.robot import first_held
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, no_rows
from pbrg_mj.governor.optimizers.synchronizer import Iterate, Synchronizer
from pbrg_mj.governor.problem.interface import StateCertificate, Status
from pbrg_mj.governor.problem.near_reference import near_references
from pbrg_mj.team.network import Network


@dataclass(frozen=True)
class LayerMemory:
    """What one robot remembers."""

    facts: RobotFacts
    held: np.ndarray  # (2,) NaN before the first decision
    flood: Flood
    verdict: Verdict
    times_sent: int  # how often this verdict was sent
    local: LocalProblem
    iterate: Iterate
    status: Status


@dataclass(frozen=True)
class LayerProgram:
    """What all robots know beforehand."""

    network: Network
    certificate: StateCertificate
    model: TeamModel
    limits: tuple[AdvanceLimit, ...]
    optimizer: Synchronizer
    reference_range: float  # a leader takes r from no farther than this, and retreats no farther [m]
    cycle_ticks: int
    repeats: int  # how often every robot passes on what is new: more than once where messages are lost
    diverged_beyond: float = math.inf  # a candidate with a larger component is of an optimizer that has diverged [m]

    def candidate_or_held(self, candidate: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return the candidate (2,) [m], or the held m where the optimizer has diverged; and whether it has."""
        diverged = not np.abs(candidate).max() <= self.diverged_beyond  # of NaN, too
        return held if diverged else candidate, diverged

    def start(self, facts: RobotFacts, own: OwnData) -> LayerMemory:
        """Return the memory before the first tick."""
        local = LocalProblem(own, self._reference(own), no_rows(), Spread.of(own.p[None], own.xi[None]))
        iterate = self.optimizer.start(facts, local)
        held = first_held(self.network, self.cycle_ticks, facts, own)
        return LayerMemory(facts, held, Flood.begin(-1), Verdict.empty(0), 0, local, iterate, "holding")

    def begin(self, own: OwnData, memory: LayerMemory) -> LayerMemory:
        """Take the measurements; at a cycle's first tick, begin its floods."""
        memory = replace(memory, local=memory.local._replace(own=own, reference=self._reference(own)))
        if own.tick % self.cycle_ticks:
            return memory
        cycle, robot = own.tick // self.cycle_ticks, memory.facts.robot
        state = STATE.pack(*own.p, *own.xi, *memory.held, own.heading, memory.verdict.forbidden)
        flood = Flood.begin(cycle).with_item(OF_STATE, robot, state)
        if robot == self._first_leader:
            candidate = self.optimizer.candidate(memory.local, memory.iterate)
            flood = flood.with_item(OF_CANDIDATE, robot, CANDIDATE.pack(*candidate))
        return self._with_own_verdict(replace(memory, flood=flood, verdict=Verdict.empty(cycle), times_sent=0))

    def send(self, memory: LayerMemory) -> tuple[Mapping[int, bytes], LayerMemory]:
        """Pass on what has not been passed on often enough, and the optimizer's message."""
        floods, flood = memory.flood.forwarded(self.repeats)
        verdict, times_sent = b"", memory.times_sent
        if memory.verdict.robots and times_sent < self.repeats:
            verdict, times_sent = memory.verdict.packed(memory.facts.robots), times_sent + 1
        iteration, iterate = self.optimizer.send(memory.iterate)
        if not (floods or verdict or iteration):
            return {}, memory
        content = packed_parts(floods, verdict, iteration)
        after = replace(memory, flood=flood, times_sent=times_sent, iterate=iterate)
        return dict.fromkeys(memory.facts.neighbours, content), after

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: LayerMemory) -> LayerMemory:
        """Take in items, verdicts and what the neighbours' optimizers say."""
        flood, verdict, iterations = memory.flood, memory.verdict, []
        for sender, content in inbox:
            floods, verdicts, iteration = unpacked_parts(content)
            flood = flood.received([floods], SIZES)
            if verdicts:
                verdict = verdict.merged(Verdict.unpacked(verdicts))
            if iteration:
                iterations.append((sender, iteration))
        iterate = self.optimizer.receive(iterations, memory.local, memory.iterate)
        times_sent = memory.times_sent if verdict == memory.verdict else 0
        return self._with_own_verdict(
            replace(memory, flood=flood, verdict=verdict, times_sent=times_sent, iterate=iterate)
        )

    def finish(self, memory: LayerMemory) -> tuple[RobotAnswer, LayerMemory]:
        """Decide in a cycle's last tick, or hold; before the first decision a leader stays where it is."""
        if (memory.local.own.tick + 1) % self.cycle_ticks == 0:
            memory = self._decided(memory)
        m = memory.local.own.p if np.isnan(memory.held).any() else memory.held
        return RobotAnswer(m, memory.status), memory

    @property
    def _first_leader(self) -> int:
        return int(np.flatnonzero(self.network.leader)[0])

    def _reference(self, own: OwnData) -> np.ndarray | None:
        """Return r as a leader takes it, (2,); None of other robots."""
        if own.reference is None:
            return None
        return near_references(own.p[None], own.reference, self.reference_range)[0]

    def _predicted(self, memory: LayerMemory) -> PredictedTeam | None:
        """Return the team in the cycle's last tick; None unless all states and the candidate are known."""
        packed = memory.flood.content(OF_CANDIDATE, self._first_leader)
        states = memory.flood.contents(OF_STATE, memory.facts.robots)
        if packed is None or states is None:
            return None
        team = np.array([STATE.unpack(state) for state in states])
        p, xi = np.ascontiguousarray(team[:, 0:2]), np.ascontiguousarray(team[:, 2:4])
        held = team[self._first_leader, 4:6].copy()
        if np.isnan(held).any():
            held = p.mean(axis=0)
        if self.cycle_ticks > 1:
            p, xi = self.model.predicted(p, xi, held, self.cycle_ticks - 1)
        candidate, diverged = self.candidate_or_held(np.array(CANDIDATE.unpack(packed)), held)
        return PredictedTeam(p, xi, team[:, 6].copy(), held, candidate, bool(team[:, 7].any()), diverged)

    def _with_own_verdict(self, memory: LayerMemory) -> LayerMemory:
        """Give the robot's own verdict on the candidate once the whole team is known."""
        robot, own = memory.facts.robot, memory.local.own
        if memory.verdict.robots >> robot & 1 or (predicted := self._predicted(memory)) is None:
            return memory
        rows = self.certificate.rows_at(own.half_spaces, predicted.p, predicted.xi, predicted.held)
        spread = Spread.of(predicted.p, predicted.xi)
        kappa, allowed = largest_kappa(rows, spread, predicted.held, predicted.candidate)
        return replace(
            memory,
            flood=memory.flood.with_item(OF_ROWS, robot, packed_rows(rows))
            if predicted.rows_requested
            else memory.flood,
            verdict=memory.verdict.with_own(robot, kappa, not allowed),
            times_sent=0,
            local=memory.local._replace(rows=rows, spread=spread),
        )

    def _decided(self, memory: LayerMemory) -> LayerMemory:
        """Return the memory with the next m, or with the one held and why."""
        predicted, verdict = self._predicted(memory), memory.verdict
        if predicted is None or not verdict.complete(memory.facts.robots):
            return replace(memory, status="holding")
        first = np.isnan(memory.held).any() and self.cycle_ticks > 1  # until now leaders stayed, and held no m
        if first or not memory.facts.leads:
            return replace(memory, held=predicted.held, status=optimizer_status(predicted))
        floods = memory.flood.contents(OF_ROWS, memory.facts.robots)
        rows = None if floods is None else unpacked_rows(floods)
        limiting, reference = (
            rows if verdict.forbidden else NO_ROWS,
            single_leader_reference(self.network, memory.local.reference),
        )
        held, status = reference_update(
            predicted, verdict.kappa, limiting, self.limits, reference, self.reference_range
        )
        return replace(memory, held=held, status=status)
