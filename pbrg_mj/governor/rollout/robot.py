"""The rollout governor as the program of one robot.

Of the graph it knows its neighbours alone, and of other robots what `messages` contains: half-spaces that bind every
robot, a box of all p, numbers of its neighbours. A robot that misses a message of a neighbour sends nothing more in
this cycle, so its neighbours miss one too. After D exchanges every robot has missed one, and D exchanges follow the
rollout. So a leader that receives all messages of its neighbours to the end knows that every robot has received all
messages, and that the verdicts are those of all robots. Otherwise it holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.rollout.messages import (
    HEADER,
    NUMBERS,
    SUMMARY,
    HalfSpace,
    Key,
    Verdict,
    own_half_spaces,
    pack_rollout,
    pack_verdicts,
    unpack_rollout,
    unpack_verdicts,
)
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.prediction import write_change, write_states
from pbrg_mj.governor.rollout.verdicts import HalfSpaceArrays, Rollout, Summary, advance, merged

UNIT = np.array([1.0, 0.0])  # m of the rollout from rest at 0 that gives the step response


@dataclass(frozen=True)
class RolloutMemory:
    """What one robot remembers."""

    facts: RobotFacts
    own: OwnData
    first: np.ndarray  # (2,) p at the start, where a leader stays until the first decision
    held: np.ndarray  # (2,) m; NaN before the first decision
    response: np.ndarray | None = None  # s (T + 1, 1); None before it is known
    status: Status = "holding"
    cycle: int = -1
    round: int = 0  # of the network, in this cycle
    complete: bool = False  # nothing is missing in this cycle so far
    summary: np.ndarray = field(default_factory=lambda: np.full(7, np.nan))  # of the flood
    half_spaces: Mapping[Key, HalfSpace] = field(default_factory=dict)
    verdicts: Mapping[Key, Verdict] = field(default_factory=dict)
    sent: frozenset[tuple] = frozenset()  # what was sent of both
    v: tuple[np.ndarray, ...] = ()  # (4,) of the rollout's step so far
    steps: tuple[tuple[np.ndarray, ...], ...] = ()  # of those before
    message: bytes = b""  # of this exchange
    received: Mapping[int, bytes] = field(default_factory=dict)  # in this exchange, by sender


@dataclass(frozen=True)
class RolloutProgram:
    """What all robots know beforehand."""

    plan: RolloutPlan

    def start(self, facts: RobotFacts, own: OwnData) -> RolloutMemory:
        """Return the memory before the first tick."""
        return RolloutMemory(facts, own, own.p, np.full(2, np.nan))

    def begin(self, own: OwnData, memory: RolloutMemory) -> RolloutMemory:
        """Take the measurements; at a cycle's first tick, begin its flood."""
        memory = replace(memory, own=own)
        if own.tick % self.plan.cycle_ticks:
            return memory
        held = memory.held if memory.facts.leads else np.full(2, np.nan)
        summary = np.concatenate([own.p, own.p, [np.hypot(*own.xi)], held])
        memory = replace(
            memory,
            cycle=own.tick // self.plan.cycle_ticks,
            round=0,
            complete=True,
            summary=summary,
            half_spaces=own_half_spaces(own.half_spaces, 0, memory.facts.robot),
            verdicts={},
            sent=frozenset(),
            v=(np.concatenate([own.p, own.xi]),),
            steps=(),
            received={},
        )
        return self._ready(memory, 0)

    def send(self, memory: RolloutMemory) -> tuple[Mapping[int, bytes], RolloutMemory]:
        """Tell all neighbours the same, as often as the plan says."""
        plan = self.plan
        exchange, repeat = divmod(memory.round, plan.rounds_of_an_exchange)
        if not memory.complete or exchange >= plan.exchanges or repeat >= plan.repeats:
            return {}, memory
        if repeat == 0:
            content, memory = self._content(exchange, memory)
            memory = replace(memory, message=self._header(memory.cycle, exchange) + content)
        return dict.fromkeys(memory.facts.neighbours, memory.message), memory

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: RolloutMemory) -> RolloutMemory:
        """Collect what belongs to this exchange, and conclude it in its last round."""
        plan = self.plan
        exchange, repeat = divmod(memory.round, plan.rounds_of_an_exchange)
        memory = replace(memory, round=memory.round + 1)
        if not memory.complete or exchange >= plan.exchanges:
            return memory
        header = self._header(memory.cycle, exchange)
        fresh = {sender: content[len(header) :] for sender, content in inbox if content.startswith(header)}
        memory = replace(memory, received={**memory.received, **fresh})
        if repeat < plan.rounds_of_an_exchange - 1:
            return memory
        if len(memory.received) < len(memory.facts.neighbours):
            return replace(memory, complete=False)
        return self._ready(replace(self._concluded(exchange, memory), received={}), exchange + 1)

    def finish(self, memory: RolloutMemory) -> tuple[RobotAnswer, RolloutMemory]:
        """Decide in a cycle's last tick, or hold."""
        if (memory.own.tick + 1) % self.plan.cycle_ticks == 0:
            memory = self._decided(memory)
        m = memory.first if np.isnan(memory.held).any() else memory.held
        return RobotAnswer(m, memory.status), memory

    def _header(self, cycle: int, exchange: int) -> bytes:
        return HEADER.pack((cycle * self.plan.exchanges + exchange) % NUMBERS)

    def _content(self, exchange: int, memory: RolloutMemory) -> tuple[bytes, RolloutMemory]:
        plan = self.plan
        if exchange < plan.diameter:
            return SUMMARY.pack(*memory.summary), memory
        if exchange < plan.exchanges - plan.diameter:
            keys = sorted(key for key, one in memory.half_spaces.items() if one.binds_all and key not in memory.sent)
            if not plan.sends_all_left(exchange):
                keys = keys[:1]
            sent = memory.sent | frozenset(keys)
            return pack_rollout(memory.v[-1], memory.half_spaces, keys), replace(memory, sent=sent)
        news = [item for item in sorted(memory.verdicts.items()) if item not in memory.sent]
        content = pack_verdicts(memory.verdicts, memory.half_spaces, [key for key, _ in news])
        return content, replace(memory, sent=memory.sent | frozenset(news))

    def _concluded(self, exchange: int, memory: RolloutMemory) -> RolloutMemory:
        """Take in what all neighbours have sent in an exchange."""
        plan, received = self.plan, [memory.received[one] for one in memory.facts.neighbours]
        if exchange < plan.diameter:
            summary = memory.summary
            for content in received:
                summary = merged(summary, np.array(SUMMARY.unpack(content)))
            return replace(memory, summary=summary)
        if exchange < plan.exchanges - plan.diameter:
            unpacked = [unpack_rollout(content) for content in received]
            half_spaces = dict(memory.half_spaces)
            for _, others in unpacked:
                half_spaces = {**others, **half_spaces}
            changes = np.array([v for v, _ in unpacked]).reshape(-1, 4)
            return self._with_change(replace(memory, half_spaces=half_spaces), changes)
        verdicts = dict(memory.verdicts)
        for content in received:
            for key, other in unpack_verdicts(content, memory.half_spaces).items():
                known = verdicts.get(key, other)
                verdicts[key] = known._replace(low=max(known.low, other.low), high=min(known.high, other.high))
        return replace(memory, verdicts=verdicts)

    def _ready(self, memory: RolloutMemory, exchange: int) -> RolloutMemory:
        """Do what comes between two phases, before an exchange."""
        plan = self.plan
        if exchange == plan.diameter and np.isnan(memory.summary[5]):  # nobody holds an m: find the step response
            memory = replace(memory, v=(np.zeros(4),))
        if exchange == plan.exchanges - plan.diameter:
            memory = self._with_verdicts(memory)
        return memory

    def _with_change(self, memory: RolloutMemory, others: np.ndarray) -> RolloutMemory:
        """Add the next v of the rollout, from the last one of the neighbours (k, 4)."""
        plan, facts = self.plan, memory.facts
        m, change = np.zeros((1, 2)), np.empty((1, 4))
        if facts.leads and len(memory.v) == 1:
            m[0] = UNIT if np.isnan(memory.summary[5]) else memory.held
        star = np.array([0, len(others)]), np.arange(1, len(others) + 1), np.array([float(facts.leads)])
        write_change(star, np.vstack([memory.v[-1], others]), m, plan.gains, change)
        v = (*memory.v, change[0])
        if len(v) <= plan.order:
            return replace(memory, v=v)
        after = np.empty((1, 1, 4))
        write_states(plan.weights[-1:], np.array(v)[:, None], after)
        return replace(memory, v=(after[0, 0],), steps=(*memory.steps, v))

    def _with_verdicts(self, memory: RolloutMemory) -> RolloutMemory:
        """Roll out what was exchanged; add what it allows, or keep the step response if that is what it was."""
        plan, robot = self.plan, memory.facts.robot
        half_spaces, robots = memory.half_spaces, np.array([robot])
        summary = Summary.of(memory.summary)
        rollout = Rollout(plan, robots, memory.steps[0][0][None], HalfSpaceArrays.of(half_spaces), summary)
        finding, found = bool(np.isnan(memory.summary[5])), [np.zeros((1, 1))]
        for v in memory.steps:
            rollout.v[:, 0] = v
            rollout.finish_step(None if finding else memory.response)
            found.append(rollout.states[:, :, 0].copy())
        if finding:
            return replace(memory, response=np.concatenate(found))
        rollout.finish()
        verdicts = {
            key: Verdict(half_spaces[key].Gx, half_spaces[key].Gy, float(low), float(high))
            for key, low, high in zip(sorted(half_spaces), rollout.low[:, 0], rollout.high[:, 0], strict=True)
            if np.isfinite(low) or np.isfinite(high)
        }
        return replace(memory, verdicts=verdicts)

    def _decided(self, memory: RolloutMemory) -> RolloutMemory:
        """Return the memory with the next m, or with the one held and the status `holding`."""
        done = memory.complete and memory.round >= self.plan.exchanges * self.plan.rounds_of_an_exchange
        if not done:
            return replace(memory, status="holding")
        summary, r = Summary.of(memory.summary), memory.own.reference
        if np.isnan(summary.held).any():
            return replace(memory, held=summary.centre, status="ok")
        if not memory.facts.leads or r is None:
            return replace(memory, held=summary.held, status="ok")
        team, plan = summary.centre - memory.held, self.plan
        moved, status = advance(r - memory.held, memory.verdicts, team, plan.reach, plan.farthest)
        return replace(memory, held=memory.held + moved, status=status)
