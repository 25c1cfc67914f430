"""Robot programs of other packages: the how-to page's example, what is carried, who counts as centralized."""

from __future__ import annotations

import re
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

import pbrg_mj as pbrg
from pbrg_mj import plugins
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.plug_in_program import PlugInRobots, robots_of_scenario
from pbrg_mj.loop.network_warnings import network_warnings
from pbrg_mj.scenario.load import load_scenario, parse_scenario

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "write-a-robot-program.md"
SHORT = {"timing.duration": 0.5, "reference.solver": "none"}
BAD_AIR = {"network.delay_rounds": 7, "network.jitter_rounds": 5, "network.loss": 0.4}


def page() -> dict[str, Any]:
    code = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert code is not None
    names: dict[str, Any] = {}
    exec(code.group(1), names)
    return names


def test_the_pages_example_keeps_the_protocol():
    report = pbrg.check_governor(page()["build"])
    assert str(report) in re.sub(r"(?m)^    ", "", PAGE.read_text("utf-8"))
    assert pbrg.check_governor(page()["ProjectedConsensus"]()).passed


@pytest.mark.parametrize("air", [{}, BAD_AIR])
def test_the_benchmark_counts_the_bytes(air, tmp_path):
    run = pbrg.run(pbrg.load("paper/simulation_near", SHORT | air), page()["ProjectedConsensus"](), tmp_path / "a.mcap")
    assert run.metrics.sent_per_robot_per_tick_bytes == 2 * 10 * 16  # neighbours, rounds, bytes; what is lost was sent
    assert not run.metrics.centralized
    assert "centralized" not in run.summary()
    assert pbrg.verify(tmp_path / "a.mcap", page()["ProjectedConsensus"]()).verdict == "identical"


def test_delay_and_silence_reach_a_program():
    """A robot's own m changes at once, another's when the first message has come: after the delay, or the outage."""

    class Maximum:
        def start(self, facts, own):
            return facts, float(facts.robot == 0)

        def begin(self, own, memory):
            return memory

        def send(self, memory):
            return dict.fromkeys(memory[0].neighbours, b"!" if memory[1] else b""), memory

        def receive(self, inbox, memory):
            return memory[0], max(memory[1], float(bool(inbox)))

        def finish(self, memory):
            return pbrg.RobotAnswer(np.full(2, memory[1]), "ok"), memory

    def heard(**network):
        keys = {"governor.rounds": 1} | {f"network.{key}": value for key, value in network.items()}
        ticks = list(pbrg.simulate(pbrg.load("paper/simulation_near", SHORT | keys), Maximum()))
        return [int(np.flatnonzero([tick.solution.m[robot, 0] for tick in ticks])[0]) for robot in range(3)]

    assert heard() == [0, 0, 1]
    assert heard(delay_rounds=4) == [0, 4, 9]
    assert heard(outages=[{"robot": 2, "time": 0.0, "duration": 0.2}]) == [0, 20, 2]  # robot 3 hears round the ring


class Omniscient:
    """Sees the whole team, solves what it likes, and says that it sent a byte."""

    def init(self, problem):
        return None

    def step(self, problem, memory):
        solution = pbrg.Solution.of(problem, problem.p.mean(axis=0))
        return pbrg.Solution(
            solution.m, solution.multipliers, "ok", 1, np.ones(problem.network.robots, dtype=np.int64)
        ), None


def test_a_governor_that_sees_the_whole_team_is_centralized_in_every_table(tmp_path, caplog):
    scenario = pbrg.load("paper/simulation_near", SHORT | {"network.loss": 0.5})
    run = pbrg.run(scenario, Omniscient(), tmp_path / "all.mcap")
    why = "the governor object:Omniscient is centralized: it sees the whole team and sends no messages"
    said = [record.getMessage() for record in caplog.records]
    assert said == [f"paper/simulation_near: network.loss has no effect: {why}"]
    again = pbrg.open(tmp_path / "all.mcap")
    for one in (run, again):
        assert one.metrics.centralized
        assert np.isnan(one.metrics.sent_per_robot_per_tick_bytes)
        assert not one.sent_bytes.any()
        assert re.search(r"sent per robot per second +centralized", one.summary())
    data = pbrg.compare(run).as_dicts()[0]
    assert (data["centralized"], data["sent_per_robot_total_bytes"]) == (True, None)
    assert re.search(r"governor +object:Omniscient\n +\(centralized\)\n", pbrg.compare(run).table())
    cards = pbrg.report([run], tmp_path / "page.html").read_text("utf-8")
    assert "object:Omniscient (centralized)" in cards


@pytest.mark.parametrize(
    ("kind", "keys", "says"),
    [
        ("centralized", {"network.delay_rounds": 3}, "network.delay_rounds has no effect: the governor centralized is"),
        ("none", {"network.delay_rounds": 3}, "with `governor.kind: none` robots send each other no messages"),
        ("distributed", {"network.delay_rounds": 3}, ""),
        ("certified", {"network.delay_rounds": 3, "network.neighbour_timeout": 0.3}, "network.neighbour_timeout has"),
    ],
)
def test_settings_of_the_network_are_never_ignored_without_a_word(kind, keys, says):
    scenario = load_scenario(
        "paper/simulation_near", [f"governor.kind={kind}", *(f"{key}={value}" for key, value in keys.items())]
    ).scenario
    warnings = network_warnings(scenario)
    assert len(warnings) == bool(says)
    assert all(says in line for line in warnings)


class Colluding:
    """Tells the others what it knows without a message."""

    everybody: dict[int, np.ndarray] = {}  # noqa: RUF012 - the point

    def start(self, facts, own):
        return facts, own

    def begin(self, own, memory):
        self.everybody[memory[0].robot] = own.p
        return memory[0], own

    def send(self, memory):
        return {}, memory

    def receive(self, inbox, memory):
        return memory

    def finish(self, memory):
        return pbrg.RobotAnswer(np.mean(list(self.everybody.values()), axis=0), "ok"), memory


def test_programs_that_talk_behind_the_benchmarks_back_are_found():
    with pytest.raises(PlugInError, match="robot 1 answers to data of robot 5 without any message") as found:
        pbrg.check_governor(Colluding())
    assert "FAILED  no robot knows of another's data while no message arrives" in str(found.value)


class Quiet:
    """Stays where it is; `answers` replaces what its methods return."""

    def __init__(self, **answers):
        self.answers = answers
        self.met: list[int] = []

    def start(self, facts, own):
        self.met.append(facts.robot)
        return own

    def begin(self, own, memory):
        return own

    def send(self, memory):
        return self.answers.get("send", ({}, memory))

    def receive(self, inbox, memory):
        return memory

    def finish(self, memory):
        return self.answers.get("finish", (pbrg.RobotAnswer(memory.p, "ok"), memory))


def test_every_robot_has_a_program_of_its_own():
    scenario = load_scenario("paper/simulation_near").scenario
    robots = robots_of_scenario(scenario, Quiet())
    assert isinstance(robots, PlugInRobots) and isinstance(robots.inner, NetworkedGovernor)
    programs = robots.inner.program.programs  # type: ignore[attr-defined]
    assert len({id(one.met) for one in programs}) == 5


@pytest.mark.parametrize(
    ("answers", "says"),
    [
        ({"send": ({3: b"x"}, None)}, "the program of robot 1 sent to 3; allowed: the numbers of its neighbours, 1, 4"),
        ({"send": ({True: b"x"}, None)}, "robot 1 sent to True"),
        ({"send": ({1: "x"}, None)}, "sent str to robot 2; allowed: bytes"),
        ({"send": ([], None)}, "sent list; allowed: a mapping"),
        ({"send": None}, "send returned NoneType, not two values"),
        ({"finish": (np.zeros(2), None)}, "finish returned ndarray and memory, not RobotAnswer"),
        ({"finish": (pbrg.RobotAnswer(np.zeros(3), "ok"), None)}, r"m has shape \(3,\), not \(2,\)"),
        ({"finish": (pbrg.RobotAnswer(np.full(2, np.nan), "ok"), None)}, "m is not finite"),
        ({"finish": (pbrg.RobotAnswer(np.zeros(2), "good"), None)}, "status is 'good'; allowed: ok"),
        ({"finish": (pbrg.RobotAnswer(np.zeros(2), "ok", None, 3), None)}, "lost is more than the robot has"),
    ],
)
def test_what_a_program_does_wrong_is_named(answers, says):
    ticks = pbrg.simulate(pbrg.load("paper/simulation_near", SHORT), Quiet(**answers))
    with pytest.raises(PlugInError, match=says):
        next(ticks)


class Options(BaseModel):
    gain: float


def offered(facts, options: Options):
    assert facts.constants.rounds == 10
    assert facts.neighbours == tuple(sorted([(facts.robot - 1) % 5, (facts.robot + 1) % 5]))
    return Quiet() if options.gain > 0 else None


def test_an_installed_program_is_named_by_a_scenario(monkeypatch):
    entry = EntryPoint("quiet", "tests.test_robot_program:offered", plugins.ROBOT_PROGRAM.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry])
    keys = SHORT | {"governor.kind": "quiet"}
    run = pbrg.run(pbrg.load("paper/simulation_near", keys | {"governor.options.gain": 1.0}))
    assert (run.metrics.governor, run.metrics.centralized, run.metrics.sent_per_robot_total_bytes) == (
        "quiet",
        False,
        0,
    )
    with pytest.raises(InputError, match=r"governor.options.gain: is missing"):
        pbrg.load("paper/simulation_near", keys)
    with pytest.raises(PlugInError, match="the robot program has no method start"):
        pbrg.run(pbrg.load("paper/simulation_near", keys | {"governor.options.gain": -1.0}))


def test_logs_of_earlier_versions_say_by_the_governors_name():
    from pbrg_mj.log.read.header import EmbeddedFiles

    scenario = parse_scenario(pbrg.load("paper/simulation_near", {"governor.kind": "centralized"}).yaml, file="x.yaml")
    embedded = EmbeddedFiles("a.mcap", {"pbrg": {"schema": "1"}})
    assert embedded._centralized(scenario)
    embedded.metadata["pbrg"]["centralized"] = "false"
    assert not embedded._centralized(scenario)
