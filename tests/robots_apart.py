"""Robots that run in threads as they would in processes of their own, for tests of the transport."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any

import pbrg_mj as pbrg
from pbrg_mj.governor.messaging.program import OwnData
from pbrg_mj.governor.problem.interface import Solution
from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.transport.mailbox import Mailbox
from pbrg_mj.transport.robot import RobotProcess
from pbrg_mj.transport.team import RobotProcesses

DIGEST = bytes(range(32))


class Killed(BaseException):
    """As if a signal had come."""


@contextmanager
def apart(scenario: Scenario, **keys: Any) -> Iterator[RobotProcesses]:
    """Give robots that run in threads as they would in processes; `keys` are those of `RobotProcess`."""
    governor, graph, dead = keys.pop("governor", None) or robot_programs(scenario), network(scenario), set()
    world = Mailbox()

    def be(robot: int) -> None:
        try:
            RobotProcess(governor, graph, robot, world.address, keys.get("digest", DIGEST)).run()
        except (Killed, Exception):
            dead.add(robot)

    team = RobotProcesses(
        governor, graph, DIGEST, world, lambda robot: "killed by SIGKILL" if robot in dead else None, 0.01
    )
    threads = [Thread(target=be, args=(robot,)) for robot in range(graph.robots)]
    for thread in threads:
        thread.start()
    try:
        yield team
    finally:
        team.stop()
        for thread in threads:
            thread.join()


def solutions(scenario: Scenario, governor: Any) -> list[Solution]:
    return [tick.solution for tick in Simulation.build(scenario).governed_by(governor).control_ticks()]


def loaded(name: str = "paper/simulation_near", duration: float = 0.2, **keys: Any) -> Scenario:
    return pbrg.load(name, {"reference.solver": "none", **keys}, duration=duration).settings


def killed_at(tick: int, robot: int, program: Any) -> Any:
    """Return a program that is killed when the tick begins."""

    class Mortal(type(program)):
        def begin(self, own: OwnData, memory: Any) -> Any:
            if own.tick == tick and memory.facts.robot == robot:
                raise Killed
            return super().begin(own, memory)

    return Mortal(**vars(program))
