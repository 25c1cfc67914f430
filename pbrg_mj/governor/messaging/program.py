"""A distributed governor as the program of one robot: what it knows, what arrives, what it sends, what it applies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from pbrg_mj.governor.problem.interface import Status
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network


class TeamConstants(NamedTuple):
    """What the whole team was set up with, and every robot knows."""

    tick: float  # [s]
    rounds: int  # per tick
    alpha_r: float  # of eq. 2 [1/s]
    leak: float  # of eq. 2 [-]
    formation: np.ndarray  # (n, 2) b [m]
    leaders: int  # how many; not who
    diameter: int  # of the graph, in links
    reference_range: float  # a leader takes r from no farther than this [m]

    @classmethod
    def of(cls, scenario: Scenario, network: Network) -> TeamConstants:
        """Return those of a scenario, whose network this is."""
        control, governor = scenario.control, scenario.governor
        return cls(
            tick=scenario.timing.tick,
            rounds=governor.rounds,
            alpha_r=control.alpha_r,
            leak=control.leak,
            formation=np.array(scenario.team.formation, dtype=float),
            leaders=int(network.leaders),
            diameter=network.diameter,
            reference_range=governor.reference_range,
        )


class RobotFacts(NamedTuple):
    """What never changes for one robot."""

    robot: int  # its own number, from 0
    robots: int  # n
    neighbours: tuple[int, ...]  # ascending
    leads: bool
    constants: TeamConstants | None = None  # None: not run from a scenario
    start: np.ndarray | None = None  # (n, 2) first p of all robots [m], where `governor.initial: start`

    @classmethod
    def of(
        cls, network: Network, robot: int, constants: TeamConstants | None = None, start: np.ndarray | None = None
    ) -> RobotFacts:
        """Return those of one robot of a network; `start` (n, 2) is copied."""
        neighbours = network.neighbours[network.first[robot] : network.first[robot + 1]]
        first = None if start is None else start.copy()
        return cls(robot, network.robots, tuple(neighbours.tolist()), bool(network.leader[robot]), constants, first)


class OwnData(NamedTuple):
    """What one robot measures at a tick."""

    tick: int
    p: np.ndarray  # (2,) shifted hand point q_i - b_i [m]
    xi: np.ndarray  # (2,) integral state [m]
    heading: float  # of its body [rad]
    half_spaces: HalfSpaces  # its own: arrays with a first axis of 1
    reference: np.ndarray | None  # (2,) the operator's r [m]; None unless the robot leads
    rows: Rows | None = None  # of its half-spaces, arrays with a first axis of 1; None if they depend on others' states
    motion: np.ndarray | None = None  # (1 + d, 2) of `vehicle.motor_lag` [m]; None where it is not kept


class RobotAnswer(NamedTuple):
    """What one robot applies, and how it got there."""

    m: np.ndarray  # (2,) [m]
    status: Status
    multipliers: np.ndarray | None = None  # (R,) of its own rows [m]; None: it has none
    lost: int = 0  # how many neighbours it counts as lost


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
