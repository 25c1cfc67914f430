"""Processes of robots: started beside the world, and ended with it; or others, which come by themselves."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.plugin_failures import take_thread_failure
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.child import THREAD_FAILURE, digest
from pbrg_mj.transport.mailbox import Mailbox
from pbrg_mj.transport.team import RobotProcesses

STOP_TIMEOUT = 5.0  # [s] for a process that was told to stop


@contextmanager
def robot_processes(scenario: Scenario, text: str, listen: Address | None = None) -> Iterator[RobotProcesses]:
    """Start a process for every robot of a scenario, whose YAML is `text`; end them all at the end.

    `listen`: start none, and wait at this address for those started elsewhere. Raises InputError for a governor
    that robots do not run themselves, and for an address that cannot be taken.
    """
    governor = robot_programs(scenario)
    mailbox = Mailbox(listen.port, listen.host) if listen else Mailbox()
    with tempfile.TemporaryDirectory(prefix="pbrg-") as folder:
        file = Path(folder) / "scenario.yaml"
        file.write_text(text, encoding="utf-8")
        children = [_started(file, robot, mailbox.address.port) for robot in range(0 if listen else scenario.robots)]
        team = RobotProcesses(
            governor,
            network(scenario),
            digest(text),
            mailbox,
            lambda robot: _end(children[robot]) if children else None,
            scenario.timing.tick,
        )
        try:
            yield team
        finally:
            team.stop()
            _ended(children)
            for failure in sorted(Path(folder).glob(f"*{THREAD_FAILURE}")):
                take_thread_failure(failure.read_text("utf-8"))


def _started(file: Path, robot: int, port: int) -> subprocess.Popen[bytes]:
    """Start a robot in a session of its own, so that Ctrl-C reaches the world alone."""
    command = [sys.executable, "-P", "-m", "pbrg_mj.transport.child", str(file), str(robot + 1), str(port)]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True)


def _end(child: subprocess.Popen[bytes]) -> str | None:
    """Return why a process is no more; None while it is there."""
    code = child.poll()
    if code is None:
        return None
    return f"killed by {signal.Signals(-code).name}" if code < 0 else f"its process ended with exit code {code}"


def _ended(children: list[subprocess.Popen[bytes]]) -> None:
    for child in children:
        try:
            child.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
