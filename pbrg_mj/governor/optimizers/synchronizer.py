"""The same iteration everywhere though messages are late or lost: a local synchronizer (Awerbuch 1985).

A robot numbers its iterations and takes the next when it has the message of every neighbour's present one. So no two
neighbours are more than one iteration apart, and what a network computes with any delays, losses and orders is what it
computes without, only later. Where messages are lost a robot repeats its present and its last one in every round: a
neighbour may still be waiting for the last.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem, Optimizer

ITERATION = struct.Struct("<I")


class Iterate(NamedTuple):
    """Where one robot's optimizer is."""

    facts: RobotFacts
    memory: Any  # the optimizer's
    iteration: int
    present: bytes  # message of this iteration
    last: bytes  # of the one before; empty in the first
    received: dict[tuple[int, int], np.ndarray]  # (neighbour, iteration) -> numbers, of this iteration and the next
    sent: bool  # this iteration's message was


@dataclass(frozen=True)
class Synchronizer:
    """An optimizer behind its synchronizer."""

    optimizer: Optimizer
    lossy: bool

    def start(self, facts: RobotFacts, local: LocalProblem) -> Iterate:
        """Return a robot's first iterate."""
        memory = self.optimizer.start(facts, local)
        return Iterate(facts, memory, 0, self._packed(memory), b"", {}, sent=False)

    def send(self, at: Iterate) -> tuple[bytes, Iterate]:
        """Return what goes to every neighbour, and the iterate."""
        if self.optimizer.numbers == 0 or (at.sent and not self.lossy):
            return b"", at
        content = ITERATION.pack(at.iteration) + at.present + (at.last if self.lossy else b"")
        return content, at._replace(sent=True)

    def receive(self, inbox: Sequence[tuple[int, bytes]], local: LocalProblem, at: Iterate) -> Iterate:
        """Keep what is of this iteration or the next, and iterate when all neighbours were received."""
        received = dict(at.received)
        size = 8 * self.optimizer.numbers
        for sender, content in inbox:
            (iteration,) = ITERATION.unpack_from(content)
            for back, start in enumerate(range(ITERATION.size, len(content), size)):
                if iteration - back >= at.iteration:
                    received[sender, iteration - back] = np.frombuffer(content, offset=start, count=size // 8)
        at = at._replace(received=received)
        names = at.facts.neighbours
        if self.optimizer.numbers == 0 or any((name, at.iteration) not in received for name in names):
            return at
        numbers = np.array([received[name, at.iteration] for name in names]).reshape(len(names), self.optimizer.numbers)
        memory = self.optimizer.step_once(local, at.memory, numbers)
        later = {key: value for key, value in received.items() if key[1] > at.iteration}
        return Iterate(at.facts, memory, at.iteration + 1, self._packed(memory), at.present, later, sent=False)

    def candidate(self, local: LocalProblem, at: Iterate) -> np.ndarray:
        """Return the m (2,) [m] that the robot would apply now."""
        return self.optimizer.candidate(local, at.memory)

    def _packed(self, memory: Any) -> bytes:
        return np.ascontiguousarray(self.optimizer.message(memory), dtype="<f8").tobytes()
