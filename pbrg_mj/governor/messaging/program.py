"""A distributed governor as the program of one robot: what it knows, what arrives, what it sends, what it applies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.perception.half_spaces import HalfSpaces


class RobotFacts(NamedTuple):
    """What never changes for one robot."""

    robot: int  # its own number, from 0
    robots: int  # n
    neighbours: tuple[int, ...]  # ascending
    leads: bool


class OwnData(NamedTuple):
    """What one robot measures at a tick."""

    tick: int
    p: np.ndarray  # (2,) shifted hand point q_i - b_i [m]
    xi: np.ndarray  # (2,) integral state [m]
    heading: float  # of its body [rad]
    half_spaces: HalfSpaces  # its own: arrays with a first axis of 1
    reference: np.ndarray | None  # (2,) the operator's r [m]; None unless the robot leads


class RobotAnswer(NamedTuple):
    """What one robot applies, and how it got there."""

    m: np.ndarray  # (2,) [m]
    status: Status


class RobotProgram(Protocol):
    """A distributed governor. One object serves all robots: what differs between them is in facts, data and memory.

    A program must not share anything between robots but its constants; messages are bytes, counted as they are.
    """

    def start(self, facts: RobotFacts, own: OwnData) -> Any:
        """Return a robot's memory before the first tick."""
        ...

    def begin(self, own: OwnData, memory: Any) -> Any:
        """Return the memory when a tick begins."""
        ...

    def send(self, memory: Any) -> tuple[Mapping[int, bytes], Any]:
        """Return this round's messages by neighbour (empty ones are not sent), and the memory."""
        ...

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: Any) -> Any:
        """Return the memory after this round's messages: (sender, content), in the order in which they were sent."""
        ...

    def finish(self, memory: Any) -> tuple[RobotAnswer, Any]:
        """Return what the robot applies at this tick, and the memory."""
        ...
