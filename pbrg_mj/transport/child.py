"""The process of one robot, as the world starts it: `python -m pbrg_mj.transport.child FILE ROBOT PORT`.

It says nothing of its own: what goes wrong in it the world is told, and says.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from pbrg_mj.errors import InputError
from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.plugin_failures import tell_thread_failures
from pbrg_mj.scenario.load import load_text
from pbrg_mj.team.graph import network
from pbrg_mj.transport.address import HOST, Address
from pbrg_mj.transport.robot import RobotProcess

FAILED = 1  # exit code
THREAD_FAILURE = ".failure"  # ending of the file beside the scenario by which the world is told of a program's thread


def digest(text: str) -> bytes:
    """Return by what world and robots tell that they have the same scenario: of its YAML text."""
    return sha256(text.encode()).digest()


def robot_process(text: str, robot: int, world: Address, wanted: Callable[[], bool] = lambda: True) -> RobotProcess:
    """Return the process of one robot, counted from 1, of the scenario in YAML.

    Raises InputError for a robot that is not there and for a governor that robots do not run themselves.
    """
    scenario = load_text(text, "scenario", file="scenario").scenario
    if not 1 <= robot <= scenario.robots:
        raise InputError(f"there is no robot {robot}; allowed: 1 to {scenario.robots}")
    return RobotProcess(robot_programs(scenario), network(scenario), robot - 1, world, digest(text), wanted)


def main() -> int:
    """Run until the world says that the run is over, or the process that started this one is gone."""
    file, robot, port = sys.argv[1:]
    failure = Path(file).with_name(f"{robot}{THREAD_FAILURE}")
    tell_thread_failures(lambda text: failure.write_text(text, "utf-8"))
    parent = os.getppid()
    text, world = Path(file).read_text("utf-8"), Address(HOST, int(port))
    process = robot_process(text, int(robot), world, lambda: os.getppid() == parent)
    with suppress(Exception):  # the world was told
        process.run()
        return 0
    return FAILED


if __name__ == "__main__":
    sys.exit(main())
