"""Robot programs of other packages: every robot has one of its own, and what it sends, answers and takes is checked."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, get_args

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.messaging.networked import NetworkedGovernor, NetworkedMemory
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts, RobotProgram, TeamConstants
from pbrg_mj.governor.plug_in import FARTHEST, LARGEST_MULTIPLIER
from pbrg_mj.governor.problem.interface import Problem, Solution, Status
from pbrg_mj.plugin_calls import call_plug_in, chosen, copied, plug_in_errors, read_only_copy, within
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network


class PlugInMemory(NamedTuple):
    """What one robot's program remembers, and whose it is."""

    facts: RobotFacts
    rows: int  # R, of each robot
    inner: Any


@dataclass(frozen=True)
class PlugInProgram:
    """Programs of another package, one for each robot: they share nothing that the benchmark hands them."""

    programs: tuple[RobotProgram, ...]
    name: str = "object"

    def start(self, facts: RobotFacts, own: OwnData) -> PlugInMemory:
        """Return a robot's first memory. Raises PlugInError when its program fails; so do all of the others."""
        inner = self._call("start", facts, read_only_copy(facts), read_only_copy(own))
        return PlugInMemory(facts, own.rows.d.shape[1] if own.rows is not None else 0, inner)

    def begin(self, own: OwnData, memory: PlugInMemory) -> PlugInMemory:
        """Return the memory when a tick begins."""
        return memory._replace(inner=self._call("begin", memory.facts, read_only_copy(own), memory.inner))

    def send(self, memory: PlugInMemory) -> tuple[Mapping[int, bytes], PlugInMemory]:
        """Return this round's messages, which must be bytes for neighbours, and the memory."""
        outbox, inner = self._pair("send", memory)
        whose = self._label(memory)
        if not isinstance(outbox, Mapping):
            raise PlugInError(f"{whose} sent {type(outbox).__name__}; allowed: a mapping from neighbours to bytes")
        for receiver, content in outbox.items():
            if type(receiver) is not int or receiver not in memory.facts.neighbours:
                raise PlugInError(f"{whose} sent to {receiver!r}; allowed: {_listed(memory.facts.neighbours)}")
            if type(content) is not bytes:
                raise PlugInError(f"{whose} sent {type(content).__name__} to robot {receiver + 1}; allowed: bytes")
        return dict(outbox), memory._replace(inner=inner)

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: PlugInMemory) -> PlugInMemory:
        """Return the memory after this round's messages."""
        return memory._replace(inner=self._call("receive", memory.facts, tuple(inbox), memory.inner))

    def finish(self, memory: PlugInMemory) -> tuple[RobotAnswer, PlugInMemory]:
        """Return a copy of what the robot applies, and the memory."""
        answer, inner = self._pair("finish", memory)
        checked = call_plug_in("robot program", self.name, "its answer", self._checked, answer, memory)
        return checked, memory._replace(inner=inner)

    def _checked(self, answer: Any, memory: PlugInMemory) -> RobotAnswer:
        whose = self._label(memory)
        if not isinstance(answer, RobotAnswer):
            raise PlugInError(f"{whose}'s finish returned {type(answer).__name__} and memory, not RobotAnswer")
        m = copied(whose, "m", answer.m, (2,))
        within(whose, "m", m, FARTHEST)
        status = chosen(whose, "status", answer.status, get_args(Status))
        lost = int(copied(whose, "lost", answer.lost, (), np.int64))
        if lost > len(memory.facts.neighbours):
            raise PlugInError(f"{whose}'s lost is more than the robot has neighbours")
        if answer.multipliers is None:
            return RobotAnswer(m, status, None, lost)
        multipliers = copied(whose, "multipliers", answer.multipliers, (memory.rows,))
        within(whose, "multipliers", multipliers, LARGEST_MULTIPLIER, least=0.0)
        return RobotAnswer(m, status, multipliers, lost)

    def _pair(self, method: str, memory: PlugInMemory) -> tuple[Any, Any]:
        answer = self._call(method, memory.facts, memory.inner)
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise PlugInError(f"{self._label(memory)}'s {method} returned {type(answer).__name__}, not two values")
        return answer

    def _call(self, method: str, facts: RobotFacts, *arguments: Any) -> Any:
        function = getattr(self.programs[facts.robot], method)
        return call_plug_in("robot program", self.name, f"{method} of robot {facts.robot + 1}", function, *arguments)

    def _label(self, memory: PlugInMemory) -> str:
        return f"{self.name}: the program of robot {memory.facts.robot + 1}"


def plug_in_program(scenario: Scenario, name: str, make: Callable[[RobotFacts], Any]) -> PlugInProgram:
    """Return the programs of a scenario's robots: `make` makes each, and the robot gets a copy that nobody else has.

    Raises what `make` raises, and PlugInError when a program cannot be copied.
    """
    team, programs = network(scenario), []
    for robot in range(team.robots):
        program = make(read_only_copy(RobotFacts.of(team, robot, TeamConstants.of(scenario, team))))
        with plug_in_errors("robot program", name, "a copy of it"):
            programs.append(copy.deepcopy(program))
    return PlugInProgram(tuple(programs), name)


@dataclass(frozen=True)
class PlugInRobots:
    """Robot programs of another package on all robots; their ticks take limited time."""

    inner: NetworkedGovernor
    name: str
    limit: float  # of a tick of all robots [s]

    def init(self, problem: Problem) -> NetworkedMemory:
        """Return the first memories. Raises PlugInError when a program fails."""
        with plug_in_errors("robot program", self.name, "its start", self.limit):
            return self.inner.init(problem)

    def step(self, problem: Problem, memory: NetworkedMemory) -> tuple[Solution, NetworkedMemory]:
        """Run a tick's rounds. Raises PlugInError when a program fails or they take too long."""
        with plug_in_errors("robot program", self.name, "a tick of all robots", self.limit):
            return self.inner.step(problem, memory)


def robots_of_scenario(scenario: Scenario, given: Any = None) -> PlugInRobots:
    """Return the robot program that a scenario names, or the object `given`, on all robots.

    Raises InputError for an unknown name and wrong options, PlugInError when it cannot be built.
    """
    if given is not None:
        program = plug_in_program(scenario, type(given).__name__, lambda facts: given)
    else:
        name, options = scenario.governor.kind, scenario.governor.options
        build = plugins.find(plugins.ROBOT_PROGRAM, name)
        program = plug_in_program(
            scenario, name, lambda facts: plugins.make(plugins.ROBOT_PROGRAM, name, build, facts, options)
        )
    return PlugInRobots(NetworkedGovernor.of(scenario, program), program.name, scenario.timing.plug_in_limit)


def _listed(neighbours: tuple[int, ...]) -> str:
    return f"the numbers of its neighbours, {', '.join(map(str, neighbours))}" if neighbours else "nobody"
