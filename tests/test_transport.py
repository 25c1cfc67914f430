"""Robots in processes of their own: what is on the wire, the values of programs in one process, robots that go."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer
from pbrg_mj.governor.registry import governor, robot_programs
from pbrg_mj.log.write.log_file import partial_path
from pbrg_mj.team.graph import network
from pbrg_mj.transport import datagrams as wire
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.mailbox import Mailbox
from pbrg_mj.transport.robot import MOST_LATE, RobotProcess
from pbrg_mj.transport.schema import CLASSES
from pbrg_mj.transport.team import RobotProcesses
from tests.robots_apart import DIGEST, apart, killed_at, loaded, solutions

FIELDS = ("m", "multipliers", "bytes_sent", "lost")
TWO = {
    "team.start": [[0.0, 0.0], [-1.0, 0.5]],
    "team.formation": [[0.0, 0.0], [-1.0, 0.0]],
    "team.leaders": [1],
    "graph": {"kind": "edges", "edges": [[1, 2]]},
    "estimator.given": [{"robot": 1, "normal": [1.0, 1.0], "offset": 3.0}],
}
CASES = {
    "the paper's, five robots": {},
    "the paper's, two robots": TWO,
    "certified": {"governor.kind": "certified"},
    "certified, over an optimizer": {"governor.kind": "certified", "governor.optimizer": "nids"},
    "rollout": {"governor.kind": "rollout"},
    "prepared for loss, of which there is none": {"network.loss": 0.1},
    "everybody is told the start": {"governor.initial": "start"},
}


@pytest.mark.parametrize("case", CASES)
def test_robots_apart_are_the_programs_in_one_process_bit_for_bit(case: str) -> None:
    scenario = loaded(**CASES[case])
    inside = loaded(**{key: value for key, value in CASES[case].items() if key != "network.loss"})
    programs = robot_programs(scenario)
    alone = solutions(scenario, NetworkedGovernor(**{**vars(programs), "channel": None}))
    with apart(inside if "network.loss" not in CASES[case] else scenario) as team:
        together = solutions(scenario, team)
    assert len(together) == 21
    for ours, theirs in zip(together, alone, strict=True):
        for field in FIELDS:
            assert getattr(ours, field).tobytes() == getattr(theirs, field).tobytes(), field
        assert ours.status == theirs.status
    links, rounds = len(network(scenario).neighbours), scenario.governor.rounds
    assert sum(one.received for one in team.traffic) == 21 * links * rounds
    assert sum(one.missed for one in team.traffic) == 0


@pytest.mark.parametrize("keys", [{}, {"governor.optimizer": "nids"}, {"team.leaders": [1, 5]}])
def test_followers_of_certified_programs_report_the_leaders_m_of_the_tick_before(keys: dict[str, Any]) -> None:
    """Of the governor for all robots at once they report that of the tick; leaders' m are the same bits."""
    scenario = loaded("paper/experiment_near", **{"governor.kind": "certified", **keys})
    carried = NetworkedGovernor(**{**vars(robot_programs(scenario)), "channel": None})
    at_once, separate = (np.array([one.m for one in solutions(scenario, by)]) for by in (governor(scenario), carried))
    leaders = np.array(scenario.team.leaders) - 1
    followers = np.setdiff1d(np.arange(5), leaders)
    np.testing.assert_array_equal(separate[:, leaders], at_once[:, leaders])
    held = at_once[:, leaders[:1]]
    assert np.ptp(held, axis=0).max() > 0.01
    np.testing.assert_array_equal(separate[1:, followers], np.broadcast_to(held[:-1], separate[1:, followers].shape))
    np.testing.assert_array_equal(at_once, np.broadcast_to(held, at_once.shape))


def test_a_robot_that_is_killed_is_silent_and_the_others_go_on(caplog: pytest.LogCaptureFixture) -> None:
    """Prepared for loss, the paper's programs count it as lost after the timeout, and hold."""
    scenario = loaded(duration=0.4, **{"network.loss": 0.1, "network.neighbour_timeout": 0.05})
    whole = robot_programs(scenario)
    killed = NetworkedGovernor(**{**vars(whole), "program": killed_at(12, 2, whole.program)})
    with apart(scenario, governor=killed) as team:
        found = solutions(scenario, team)
    assert team.gone == {2: "killed by SIGKILL"}
    lines = [one.getMessage() for one in caplog.records]
    assert lines == ["robot 3 is lost at t = 0.12 s: killed by SIGKILL; it sends nothing and holds its m from then on"]
    assert found[11].status != "holding"
    assert all(one.status == "holding" for one in found[12:])
    assert all((one.m[2] == found[11].m[2]).all() and one.bytes_sent[2] == 0 for one in found[12:])
    assert found[-1].lost.tolist() == [0, 1, 0, 1, 0]
    for earlier, later in zip(found[-5:], found[-4:], strict=False):
        assert (earlier.m == later.m).all()


def test_the_certified_leader_moves_no_more_without_everybodys_verdict() -> None:
    scenario = loaded(duration=0.3, **{"governor.kind": "certified"})
    whole = robot_programs(scenario)
    killed = NetworkedGovernor(**{**vars(whole), "program": killed_at(10, 0, whole.program)})
    with apart(scenario, governor=killed) as team:
        found = solutions(scenario, team)
    leader = [one.m[4] for one in found]
    assert (leader[9] != leader[5]).any()
    assert all((one == leader[10]).all() for one in leader[10:])


def test_a_program_that_fails_ends_the_run_in_one_line() -> None:
    def broken(self: Any, own: OwnData, memory: Any) -> Any:
        raise ZeroDivisionError("no way\nout")

    scenario = loaded()
    whole = robot_programs(scenario)
    program = type("Broken", (type(whole.program),), {"begin": broken})(**vars(whole.program))
    with (
        apart(scenario, governor=NetworkedGovernor(**{**vars(whole), "program": program})) as team,
        pytest.raises(pbrg.PbrgError, match=r"^robot \d: no way out$"),
    ):
        solutions(scenario, team)


def strange_body(kind: wire.Kind, content: bytes) -> Any:
    """Return a body of a kind that says next to nothing."""
    messages = {wire.Kind.START: "Start", wire.Kind.OWN: "OwnData", wire.Kind.ANSWER: "Answer"}
    if kind in messages:
        return CLASSES[messages[kind]]()
    bodies = {wire.Kind.HELLO: content, wire.Kind.MESSAGE: content, wire.Kind.GONE: len(content)}
    return content.hex() if kind is wire.Kind.FAILED else bodies.get(kind)


def unknown(ports: Callable[[], list[Address]], over: Event) -> None:
    """Send nonsense, and what looks like messages of the world's or a robot's, until it is over."""
    random, box = np.random.default_rng(3), Mailbox()
    while not over.is_set():
        for place in ports():
            kind, robot = wire.Kind(random.choice(list(wire.Kind))), int(random.choice([0, 1, 7, wire.WORLD]))
            body = random.bytes(int(random.integers(0, 90)))
            box.send(place, wire.Datagram(kind, robot, int(random.integers(40)), 0, 0, strange_body(kind, body)))
            box._socket.sendto(random.bytes(int(random.integers(0, 60))), place)
        time.sleep(1e-3)
    box.close()


def test_nonsense_and_strangers_change_no_bit() -> None:
    """Greetings aside: whoever knows the scenario's digest may say that he is a robot."""
    scenario, over = loaded(duration=0.3), Event()
    expected = solutions(scenario, robot_programs(scenario))
    with apart(scenario) as team:

        def ports() -> list[Address]:
            known = list(team._places.values())
            return [team.mailbox.address, *known] if len(known) == scenario.robots else known

        sender = Thread(target=unknown, args=(ports, over))
        sender.start()
        try:
            found = solutions(scenario, team)
        finally:
            over.set()
            sender.join()
    assert not team.gone
    for one, other in zip(found, expected, strict=True):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_robot_listens_to_nobody_but_the_world_that_it_greets() -> None:
    world, stranger, scenario = Mailbox(), Mailbox(), loaded()
    robot = RobotProcess(robot_programs(scenario), network(scenario), 0, world.address, DIGEST)
    for one in (
        wire.Datagram(wire.Kind.STOP, wire.WORLD),
        wire.Datagram(wire.Kind.START, wire.WORLD, body=CLASSES["Start"]()),
    ):
        stranger.send(robot.mailbox.address, one)
    world.send(robot.mailbox.address, wire.Datagram(wire.Kind.STOP, wire.WORLD))
    with pytest.raises(pbrg.PbrgError, match=r"sends robot 1 away"):
        robot.run()
    assert world.receive(5.0)[0].kind is wire.Kind.HELLO  # type: ignore[index]
    world.close()
    stranger.close()


def answered(m: Any, count: int, **changes: Any) -> Any:
    message = wire.answer_message(RobotAnswer(np.array(m), "ok", np.zeros(count)), wire.Traffic())
    message.MergeFrom(CLASSES["Answer"](**changes))
    return message


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (CLASSES["Answer"](), "Answer without m"),
        (answered([np.nan, 0.0], 10), "m is not finite"),
        (answered([0.0, 1.0], 3), "3 multipliers for 20 rows"),
        (answered([0.0, 1.0], 20, status="fine\n"), r"status 'fine\\n'"),
        (answered([0.0, 1.0], 20, traffic={"bytes_sent": 1 << 63}), "9223372036854775808 bytes sent"),
    ],
)
def test_an_answer_that_is_none_ends_the_run_in_one_line(answer: Any, told: str) -> None:
    """As of a robot whose program is somebody else's."""
    scenario = loaded()
    world = Mailbox()
    team = RobotProcesses(robot_programs(scenario), network(scenario), DIGEST, world, tick_seconds=0.01)
    answers = {wire.Kind.START: wire.Kind.READY, wire.Kind.OWN: wire.Kind.ANSWER}

    def be(robot: int) -> None:
        box = Mailbox()
        box.send(world.address, wire.Datagram(wire.Kind.HELLO, robot, body=DIGEST))
        while (came := box.receive(20.0)) and came[0].kind is not wire.Kind.STOP:
            if kind := answers.get(came[0].kind):
                body = answer if kind is wire.Kind.ANSWER else None
                box.send(world.address, wire.Datagram(kind, robot, came[0].tick, body=body))
        box.close()

    threads = [Thread(target=be, args=(robot,)) for robot in range(scenario.robots)]
    for thread in threads:
        thread.start()
    try:
        with pytest.raises(pbrg.PbrgError, match=rf"^robot \d's answer at tick 0 is none: .*{told}"):
            solutions(scenario, team)
    finally:
        team.stop()
        for thread in threads:
            thread.join()


def test_a_robot_of_another_scenario_is_sent_away() -> None:
    with apart(loaded(), digest=bytes(32)) as team, pytest.raises(pbrg.PbrgError, match="another scenario"):
        solutions(loaded(), team)


def test_a_robot_that_is_sent_away_says_so() -> None:
    box, scenario = Mailbox(), loaded()

    def send_away() -> None:
        came = box.receive(30.0)
        if came is not None:
            box.send(came[1], wire.Datagram(wire.Kind.STOP, wire.WORLD))

    world = Thread(target=send_away)
    world.start()
    with pytest.raises(pbrg.PbrgError, match=rf"the world at {box.address} sends robot 1 away"):
        RobotProcess(robot_programs(scenario), network(scenario), 0, box.address, DIGEST).run()
    world.join()
    box.close()


def test_a_robot_that_cannot_come_ends_the_run() -> None:
    team = RobotProcesses(robot_programs(loaded()), network(loaded()), DIGEST, Mailbox(), lambda robot: "killed")
    with pytest.raises(pbrg.PbrgError, match="robot 1 has not come: killed"):
        solutions(loaded(), team)
    team.stop()


def test_a_port_that_is_taken_is_one_line() -> None:
    taken = Mailbox()
    port = taken.address.port
    with pytest.raises(pbrg.InputError, match=rf"^UDP port {port} of this machine: another process has it"):
        Mailbox(port)
    taken.close()


WRONG_ADDRESSES = {
    "7400": "'7400' is no address; allowed: HOST:PORT, such as 192.168.0.7:7400",
    "here:x": "'here:x' is no address",
    "localhost:70000": "is no address",
    "no.such.host.invalid:1": "no such host",
}


@pytest.mark.parametrize("text", WRONG_ADDRESSES)
def test_a_wrong_address_is_one_line(text: str) -> None:
    with pytest.raises(pbrg.InputError) as found:
        Address.of(text)
    assert WRONG_ADDRESSES[text] in str(found.value) and "\n" not in str(found.value)


def test_sockets_are_on_the_loopback_interface_unless_another_is_asked_for() -> None:
    box = Mailbox()
    assert box.address.host == "127.0.0.1" and Address.of(f"localhost:{box.address.port}") == box.address
    assert Address.of("localhost:1").local_host() == "127.0.0.1"
    box.close()
    with pytest.raises(pbrg.InputError, match=r"^UDP port 0 of 192\.0\.2\.1: "):  # an address that nobody has
        Mailbox(host="192.0.2.1")


def lone_robot(box: Mailbox) -> RobotProcess:
    """Return robot 1, whose neighbours are robots 2 and 5, with its world at a mailbox."""
    robot = RobotProcess(robot_programs(loaded()), network(loaded()), 0, box.address, DIGEST)
    robot._places = {0: Address("10.0.0.1", 1), 1: Address("10.0.0.1", 2), 4: Address("10.0.0.2", 3)}
    return robot


def test_delays_count_within_a_machine_alone() -> None:
    """Clocks of two machines have nothing in common: a neighbour elsewhere is heard, and not timed."""
    box = Mailbox()
    robot = lone_robot(box)
    for sender in (1, 4):
        robot._store(wire.Datagram(wire.Kind.MESSAGE, sender, sent_ns=1, body=b""))
    assert (robot._traffic.received, robot._traffic.timed) == (2, 1)
    for one in (robot.mailbox, box):
        one.close()


def test_a_message_larger_than_a_datagram_is_one_line() -> None:
    box = Mailbox()
    with pytest.raises(pbrg.InputError, match="robot 4's message has 70025 bytes; a datagram takes 65507"):
        box.send(box.address, wire.Datagram(wire.Kind.MESSAGE, 3, body=bytes(70_008)))
    with pytest.raises(pbrg.InputError, match="the world's message has 70023 bytes; "):
        box.send(box.address, wire.Datagram(wire.Kind.MESSAGE, wire.WORLD, body=bytes(70_008)))
    box.close()


def test_times_that_tell_nothing_count_as_none() -> None:
    """A neighbour of other code may have no clock, or another one."""
    box = Mailbox()
    robot = lone_robot(box)
    for sent_ns in (0, (1 << 64) - 1):
        robot._store(wire.Datagram(wire.Kind.MESSAGE, 1, sent_ns=sent_ns, body=b""))
    assert (robot._traffic.received, robot._traffic.timed, robot._traffic.delay_sum_ns) == (2, 0, 0)
    for one in (robot.mailbox, box):
        one.close()


def test_messages_that_nobody_waits_for_do_not_pile_up() -> None:
    """Nobody is ahead of the world or has more rounds; of what comes late some thousand rounds are kept."""
    box = Mailbox()
    robot = lone_robot(box)
    for tick, k in [(0, 9), (1, 0), (1 << 30, 0), (0, 10), (0, 1 << 30)]:
        robot._store(wire.Datagram(wire.Kind.MESSAGE, 1, tick, k, body=b"x"))
    assert list(robot._messages) == [(0, 9)]
    robot._expected = 1 << 30
    for tick in range(5000):
        robot._store(wire.Datagram(wire.Kind.MESSAGE, 1, tick, 0, body=b"x"))
    assert len(robot._messages) == MOST_LATE + 10
    for one in (robot.mailbox, box):
        one.close()


def world_that_sends(body: Any, kind: wire.Kind = wire.Kind.START) -> str:
    """Return what robot 1 says and ends with when its world answers its greeting with this."""
    box = Mailbox()

    def answer() -> None:
        came = box.receive(30.0)
        if came is not None:
            box.send(came[1], wire.Datagram(kind, wire.WORLD, body=body))

    world = Thread(target=answer)
    world.start()
    with pytest.raises(pbrg.PbrgError) as found:
        RobotProcess(robot_programs(loaded()), network(loaded()), 0, box.address, DIGEST).run()
    world.join()
    while (came := box.receive(5.0)) and came[0].kind is not wire.Kind.FAILED:
        pass
    box.close()
    assert came is not None and came[0].body == str(found.value)
    return str(found.value)


def test_a_world_that_says_what_is_no_start_ends_the_robot_in_one_line() -> None:
    assert world_that_sends(CLASSES["Start"]()) == "what the world sends at tick 0 is no start: Start without own"
    whole = CLASSES["Start"](
        own={"p": {}, "xi": {}, "half_spaces": {}}, places=[{"robot": 1, "host": "1.2.3.4", "port": 1}]
    )
    assert world_that_sends(whole) == "the world does not tell robot 1 where robot 2 is"


def test_what_no_text_can_hold_does_not_keep_a_robot_from_telling(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Any, facts: Any, own: Any) -> Any:
        raise ValueError("a file named \udcff")

    whole = robot_programs(loaded())
    monkeypatch.setattr(type(whole.program), "start", broken)
    with apart(loaded()) as team, pytest.raises(pbrg.PbrgError, match=r"^robot \d: a file named \?$"):
        solutions(loaded(), team)


def test_nobody_greets_as_the_world_or_as_a_robot_that_is_not_there() -> None:
    box, stranger = Mailbox(), Mailbox()
    team = RobotProcesses(robot_programs(loaded()), network(loaded()), DIGEST, box)
    for robot in (wire.WORLD, 5, 4_294_967_294):
        stranger.send(box.address, wire.Datagram(wire.Kind.HELLO, robot, body=bytes(32)))
    with pytest.raises(pbrg.PbrgError, match="not connected"):
        team.wait_for_robots(timeout=0.2)
    for robot in (wire.WORLD, 5):
        stranger.send(box.address, wire.Datagram(wire.Kind.HELLO, robot, body=DIGEST))
    team.stop()
    assert team._places == {}
    stranger.close()


@pytest.mark.parametrize("kind", ["none", "centralized", "cbf"])
def test_governors_that_robots_do_not_run_are_refused(kind: str) -> None:
    with pytest.raises(pbrg.InputError, match=rf"governor\.kind: is {kind}, which robots do not run themselves"):
        robot_programs(loaded(**{"governor.kind": kind}))


def running(log: Path, *options: str) -> subprocess.Popen[str]:
    name = ("paper/simulation_near", "--set", "reference.solver=none", "--quiet", "--processes")
    command = [sys.executable, "-P", "-m", "pbrg_mj", "run", *name, "-o", str(log), *options]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def children(parent: int) -> dict[int, str]:
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            if int(fields[1]) == parent:
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue
    return found


def is_written(log: Path) -> bool:
    """Return whether the first ticks are in the log: a header alone has fewer bytes."""
    partial = partial_path(log)
    return partial.exists() and partial.stat().st_size > 20_000


def wait_until(there: Callable[[], object]) -> None:
    until = time.monotonic() + 240.0
    while not there():
        assert time.monotonic() < until
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc")
def test_processes_are_killed_and_interrupted(tmp_path: Path) -> None:
    """One robot is killed: a line and exit code 1. Then Ctrl-C: 130, and nobody is left."""
    log = tmp_path / "killed.mcap"
    world = running(log, "--duration", "6", "--pace", "1")
    wait_until(lambda: is_written(log))
    (robot,) = [pid for pid, line in children(world.pid).items() if re.search(r"child \S+ 3 ", line)]
    os.kill(robot, signal.SIGKILL)
    _, said = world.communicate(timeout=300)
    assert world.returncode == 1
    (line,) = said.splitlines()
    assert "robot 3 is lost at t = " in line and "killed by SIGKILL" in line

    log = tmp_path / "stopped.mcap"
    world = running(log, "--duration", "60", "--pace", "1")
    wait_until(lambda: is_written(log))
    robots = children(world.pid)
    world.send_signal(signal.SIGINT)
    _, said = world.communicate(timeout=300)
    assert (world.returncode, len(robots)) == (130, 5)
    assert said.splitlines() == [f"interrupted; the log so far: {log}"]
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in robots))


def robots_by_hand(address: str, *options: str) -> list[subprocess.Popen[str]]:
    command = [sys.executable, "-P", "-m", "pbrg_mj", "robot", "paper/simulation_near"]
    return [
        subprocess.Popen([*command, str(robot), "--connect", address, *options], stderr=subprocess.PIPE, text=True)
        for robot in range(1, 6)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["distributed", "certified"])
def test_robots_started_by_hand_are_those_of_one_process_and_their_log_replays(kind: str, tmp_path: Path) -> None:
    """The world waits at an address; five commands come, as they would from other machines; nothing differs."""
    log, keys = tmp_path / "hand.mcap", ("--set", "reference.solver=none", "--set", f"governor.kind={kind}")
    command = [sys.executable, "-P", "-m", "pbrg_mj", "run", "paper/simulation_near", "--listen", "127.0.0.1:0"]
    world = subprocess.Popen([*command, "--duration", "0.2", *keys, "-o", str(log)], stderr=subprocess.PIPE, text=True)
    assert world.stderr is not None
    waiting = next(line for line in world.stderr if "waiting for robots 1 to 5 at " in line)
    robots = robots_by_hand(waiting.split()[-1], "--duration", "0.2", *keys)
    _, said = world.communicate(timeout=300)
    assert (world.returncode, [one.communicate(timeout=60)[1] for one in robots]) == (0, [""] * 5)
    assert "2100 came, 0 were missed" in said
    found = pbrg.verify(log)
    assert (found.verdict, found.found.ticks) == ("identical", 21)
