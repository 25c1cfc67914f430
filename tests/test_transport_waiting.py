"""A world that no robot comes to, robots that no world answers: limits of time by a clock of the test's own."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from itertools import count, pairwise
from pathlib import Path
from time import sleep
from typing import Any

import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import PbrgError
from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network
from pbrg_mj.transport import robot as robots
from pbrg_mj.transport import team as teams
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.datagrams import WORLD, Datagram, Kind
from pbrg_mj.transport.mailbox import Mailbox

SCENARIO = load_scenario("paper/simulation_near", ("reference.solver=none",)).scenario
DIGEST = bytes(32)


def team(box: Mailbox, **keys: Any) -> teams.RobotProcesses:
    return teams.RobotProcesses(robot_programs(SCENARIO), network(SCENARIO), DIGEST, box, **keys)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every look at the clock is 10 s after the one before."""
    for module in (robots, teams):
        monkeypatch.setattr(module, "monotonic", count(0.0, 10.0).__next__)
    monkeypatch.setattr(Mailbox, "receive", lambda self, timeout: None)


@pytest.mark.usefixtures("clock")
def test_a_world_without_robots_names_them_after_five_minutes() -> None:
    world = team(Mailbox())
    late = rf"^not connected to {world.mailbox.address} within 300 s: robots 1, 2, 3, 4, 5$"
    with pytest.raises(PbrgError, match=late):
        world.wait_for_robots()
    world.stop()


@pytest.mark.usefixtures("clock")
def test_a_run_that_no_robot_comes_to_is_one_line_and_no_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "paper/simulation_near", "--listen", "127.0.0.1:0", "--quiet", "-o", "r.mcap"]) == 1
    waiting, said = capsys.readouterr().err.splitlines()
    assert waiting.startswith("waiting for robots 1 to 5 at 127.0.0.1:")
    assert said.startswith("error: not connected to 127.0.0.1:") and said.endswith("within 300 s: robots 1, 2, 3, 4, 5")
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("clock")
def test_a_robot_that_no_world_answers_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "paper/simulation_near", "1", "--connect", "127.0.0.1:9"]) == 1
    assert capsys.readouterr() == ("", "error: no world answers at 127.0.0.1:9, UDP\n")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_the_first_signal_ends_the_waiting(
    number: int, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    looks = count()

    def nobody(_self: Mailbox, _patience: float) -> None:
        look = next(looks)
        if look == 2:
            signal.raise_signal(number)
        assert look < 1000, "it goes on waiting"
        sleep(1e-3)

    monkeypatch.setattr(Mailbox, "receive", nobody)
    assert main(["run", "paper/simulation_near", "--listen", "127.0.0.1:0", "--quiet", "-o", "r.mcap"]) == code
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_robot_waits_for_a_world_that_waits_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two minutes by the clock, while alone it would try for one."""
    world = Address("127.0.0.1", 9)
    robot = robots.RobotProcess(robot_programs(SCENARIO), network(SCENARIO), 0, world, DIGEST)
    monkeypatch.setattr(robots, "monotonic", count(0.0, 10.0).__next__)

    def coming() -> Iterator[tuple[Datagram, Address] | None]:
        yield Datagram(Kind.HELLO, WORLD, body=b""), world
        yield from [None] * 12
        yield Datagram(Kind.STOP, WORLD), world

    came = coming()
    monkeypatch.setattr(Mailbox, "receive", lambda self, timeout: next(came))
    with pytest.raises(PbrgError, match=r"the world at .* sends robot 1 away"):
        robot.run()


def test_a_robot_greets_again_after_a_while_and_not_for_every_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """A world that waits for others answers at once: robot and world filled the network with greetings."""
    world, clock, greetings = Address("127.0.0.1", 9), [0.0], []
    robot = robots.RobotProcess(robot_programs(SCENARIO), network(SCENARIO), 0, world, DIGEST)

    def receive(_self: Mailbox, timeout: float) -> tuple[Datagram, Address]:
        clock[0] += max(1e-6, min(timeout, 0.001))
        return Datagram(Kind.STOP if clock[0] > 2.0 else Kind.HELLO, WORLD, body=b""), world

    monkeypatch.setattr(robots, "monotonic", lambda: clock[0])
    monkeypatch.setattr(Mailbox, "receive", receive)
    monkeypatch.setattr(Mailbox, "send", lambda self, to, one: greetings.append((clock[0], one.kind)))
    with pytest.raises(PbrgError, match="sends robot 1 away"):
        robot.run()
    times = [at for at, kind in greetings if kind is Kind.HELLO]
    assert 9 <= len(times) <= 11
    assert min(later - sooner for sooner, later in pairwise(times)) >= robots.RETRY_PERIOD


def test_a_world_answers_greetings_until_all_have_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teams, "monotonic", iter([0.0, 0.0, 10.0]).__next__)
    box, other = Mailbox(), Mailbox()
    other.send(box.address, Datagram(Kind.HELLO, 3, body=DIGEST))
    with pytest.raises(PbrgError, match=r"robots 1, 2, 3, 5$"):
        team(box).wait_for_robots(timeout=5.0)
    came = other.receive(30.0)
    assert came is not None
    assert (came[0].kind, came[0].robot, came[1]) == (Kind.HELLO, WORLD, box.address)
    other.close()
    box.close()


def test_a_robot_is_not_sent_to_port_0(capsys: pytest.CaptureFixture[str]) -> None:
    """Any free port, for one who listens; nowhere, for one who connects."""
    assert main(["robot", "paper/simulation_near", "1", "--connect", "127.0.0.1:0"]) == 2
    assert capsys.readouterr() == ("", "error: no way to 127.0.0.1:0: nobody is at port 0\n")
