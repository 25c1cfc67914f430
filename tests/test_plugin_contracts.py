"""A part that breaks its contract ends the run with its name in one line, exit code 1, and a log that says why."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj import plugins
from pbrg_mj.cli.main import main
from pbrg_mj.errors import PlugInError
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.plugin_calls import copied, plug_in_errors, read_only_copy
from scripts.fuzz.sandbox import run_apart


def plan(*overrides, duration=0.3):
    return pbrg.load("paper/simulation_near", overrides, duration=duration)


@dataclass
class Mine:
    """Holds its place, but for what a test has it do in the third tick."""

    act: object = None
    changes: dict | None = None
    ticks: int = 0

    def init(self, problem):
        return None

    def step(self, problem, memory):
        self.ticks += 1
        answer = pbrg.Solution.of(problem, problem.p.mean(axis=0))
        if self.ticks == 3 and self.act is not None:
            self.act(problem)
        if self.ticks == 3 and self.changes:
            answer = replace(answer, **self.changes)
        return answer, memory


def ended_by(governor, *overrides, **parts):
    ticks = []
    with pytest.raises(PlugInError) as caught:
        ticks.extend(pbrg.simulate(plan(*overrides), governor, **parts))
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    assert len(text) < 500
    return text


class OwnStop(BaseException):
    pass


class Mute(Exception):
    def __str__(self):
        raise RuntimeError


def raising(error):
    def act(problem):
        raise error

    return act


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (SystemExit(0), "Mine: the governor raised SystemExit in step: 0"),
        (GeneratorExit(), "Mine: the governor raised GeneratorExit in step: "),
        (StopIteration(), "Mine: the governor raised StopIteration in step: "),
        (OwnStop("own"), "Mine: the governor raised OwnStop in step: own"),
        (pbrg.InputError("no such file"), "Mine: the governor raised InputError in step: no such file"),
        (ValueError("two\nlines"), "Mine: the governor raised ValueError in step: two lines"),
        (MemoryError(), "Mine: the governor raised MemoryError in step: "),
        (Mute(), "Mine: the governor raised Mute in step: "),
    ],
)
def test_whatever_a_step_raises_is_put_down_to_it(error, says):
    assert ended_by(Mine(raising(error))) == says


def test_a_keyboard_interrupt_of_its_own_is_put_down_to_it(tmp_path):
    with pytest.raises(PlugInError, match="Mine: the governor raised KeyboardInterrupt in step: "):
        pbrg.run(plan(), Mine(raising(KeyboardInterrupt())), tmp_path / "own.mcap")


def test_ctrl_c_is_none_of_its_failures(tmp_path):
    """Neither in a run, which ends between two ticks, nor where Python's own handler raises at once."""
    interrupt = Mine(lambda _: signal.raise_signal(signal.SIGINT))
    with pytest.raises(pbrg.Interrupted) as caught:
        pbrg.run(plan(), interrupt, tmp_path / "log.mcap")
    assert caught.value.signal == signal.SIGINT
    with pytest.raises(KeyboardInterrupt):
        list(pbrg.simulate(plan(), Mine(lambda _: signal.raise_signal(signal.SIGINT))))


class Equal:
    """Equals everything."""

    def __eq__(self, other):
        return True

    __hash__ = object.__hash__


FIVE = np.zeros(5)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"m": np.full((5, 2), np.nan)}, "m is not finite; hold the last reference"),
        ({"m": np.full((5, 2), np.inf)}, "m is not finite"),
        ({"m": np.full((5, 2), 1e300)}, "m is larger than 1e+09"),
        ({"m": np.zeros((5, 2), dtype=complex)}, "m is no array of float64: it holds complex128"),
        ({"m": np.full((5, 2), "1")}, "m is no array of float64: it holds <U1"),
        ({"m": np.zeros((5, 2), dtype=object)}, "m is no array of float64: it holds object"),
        ({"m": np.ma.masked_array(np.zeros((5, 2)), mask=True)}, "m is no array of float64: it holds float64"),
        ({"m": [[0.0, 0.0], [0.0]]}, "m is no array of float64"),
        ({"m": None}, "m is no array of float64: it holds object"),
        ({"m": np.zeros((5, 3))}, "m has shape (5, 3), not (5, 2)"),
        ({"multipliers": np.full((5, 20), np.nan)}, "multipliers is not finite"),
        ({"multipliers": np.full((5, 20), -1.0)}, "multipliers is less than 0"),
        ({"multipliers": np.full((5, 20), 1e200)}, "multipliers is larger than 1e+12"),
        ({"bytes_sent": FIVE - 1}, "bytes_sent is [-1.0, -1.0, -1.0, -1.0, -1.0]; allowed: whole numbers from 0 on"),
        ({"bytes_sent": FIVE + np.nan}, "bytes_sent is [nan, nan, nan, nan, nan]; allowed: whole numbers from 0 on"),
        ({"bytes_sent": FIVE + 0.5}, "bytes_sent is [0.5"),
        ({"bytes_sent": FIVE + 1e300}, "bytes_sent is [1e+300"),
        ({"bytes_sent": np.zeros((5, 1))}, "bytes_sent has shape (5, 1), not (5,)"),
        ({"lost": np.full(5, 3)}, "lost is more than a robot has neighbours"),
        ({"rounds": -1}, "rounds is -1; allowed: whole numbers from 0 on"),
        ({"rounds": 10**30}, "rounds is no array of int64: it holds object"),
        ({"rounds": "ten"}, "rounds is no array of int64: it holds <U3"),
        ({"rounds": True}, "rounds is no array of int64: it holds bool"),
        ({"status": "fine"}, "status is 'fine'; allowed: ok, "),
        ({"status": 3}, "status is 3; allowed: ok"),
        ({"status": None}, "status is None; allowed: ok"),
        ({"status": ["ok"]}, "status is ['ok']; allowed: ok"),
        ({"status": Equal()}, "allowed: ok"),
    ],
)
def test_every_part_of_an_answer_is_checked(changes, says):
    assert ended_by(Mine(changes=changes)).startswith("Mine: the governor's ")
    assert says in ended_by(Mine(changes=changes))


def test_check_governor_reports_the_same():
    for changes in ({"status": Equal()}, {"multipliers": np.full((5, 15), np.nan)}, {"rounds": True}):
        built = Mine(changes=changes, ticks=2)
        with pytest.raises(PlugInError, match="no half-spaces: Mine: the governor's"):
            pbrg.check_governor(built)
    with pytest.raises(PlugInError, match="Mine: the governor raised SystemExit in step: 0"):
        pbrg.check_governor(Mine(raising(SystemExit(0)), ticks=2))


@pytest.mark.parametrize(
    "write",
    [
        lambda problem: problem.p.__setitem__(0, 9.0),
        lambda problem: problem.xi.fill(0.0),
        lambda problem: problem.reference.__iadd__(1.0),
        lambda problem: problem.rows.d.__imul__(2.0),
        lambda problem: problem.rows.active.fill(False),
        lambda problem: problem.network.laplacian.fill(0.0),
        lambda problem: problem.network.leader.fill(1.0),
    ],
)
def test_inputs_cannot_be_written_into(write):
    assert "read-only" in ended_by(Mine(write))


def test_what_is_forced_open_changes_nothing_but_a_copy():
    def force(problem):
        for array in (problem.p, problem.xi, problem.rows.d, problem.network.leader):
            array.flags.writeable = True
            array[...] = 1e6
        object.__setattr__(problem, "p", None)

    one, other = (list(pbrg.simulate(plan(), governor)) for governor in (Mine(force), Mine()))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.truth.hand_world, b.truth.hand_world)
        np.testing.assert_array_equal(a.problem.rows.d, b.problem.rows.d)


def test_numpy_is_as_it_was_after_a_call():
    with plug_in_errors("governor", "mine", "step"):
        np.seterr(all="raise")
    assert np.geterr()["under"] == "ignore"


def for_ever(problem):
    while True:
        pass


def stubborn(problem):
    for _ in range(2):
        try:
            while True:
                pass
        except BaseException:
            continue


def swallowing(problem):
    while True:
        try:
            while True:
                time.sleep(0.001)
        except Exception:
            continue


@pytest.mark.parametrize("act", [for_ever, stubborn, swallowing])
def test_a_step_that_takes_too_long_is_ended(act):
    says = "Mine: the governor took more than 0.3 s in step, the limit of timing.plug_in_limit"
    assert ended_by(Mine(act), "timing.plug_in_limit=0.3") == says


def test_in_another_thread_it_is_ended_when_it_comes_back():
    found = []

    def run():
        try:
            with plug_in_errors("governor", "mine", "step", 0.01):
                time.sleep(0.05)
        except PlugInError as error:
            found.append(str(error))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert found == ["mine: the governor took more than 0.01 s in step, the limit of timing.plug_in_limit"]


def test_the_limit_leaves_timers_and_handlers_as_they_were():
    before = signal.getsignal(signal.SIGALRM)
    with plug_in_errors("governor", "mine", "step", 5.0):
        pass
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_the_clock_is_in_no_result():
    one, other = (list(pbrg.simulate(plan(f"timing.plug_in_limit={limit}"), Mine())) for limit in (5, 60))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.solution.m, b.solution.m)
        np.testing.assert_array_equal(a.truth.hand_world, b.truth.hand_world)


@pytest.fixture
def leaving(monkeypatch):
    entry = EntryPoint("leaving", "tests.test_plugin_contracts:build_leaving", plugins.GOVERNOR.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry] if group == plugins.GOVERNOR.group else [])


def build_leaving(scenario):
    return Mine(lambda problem: sys.exit(0))


@pytest.mark.usefixtures("leaving")
def test_the_command_ends_with_1_and_a_log_that_says_why(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["paper/simulation_near", "--duration", "1", "--set", "governor.kind=leaving", "-o", "a.mcap"]
    assert main(["run", *arguments, "--quiet"]) == 1
    assert capsys.readouterr() == ("", "error: leaving: the governor raised SystemExit in step: 0\n")
    run = pbrg.open("a.mcap")
    assert len(run.time_s) == 2
    assert "leaving: the governor raised SystemExit" in "\n".join(run.replay().lines())
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


class Threaded(Mine):
    """Starts a thread that fails, in every tick."""

    def step(self, problem, memory):
        thread = threading.Thread(target=raising(ValueError("in a thread")), args=(problem,))
        thread.start()
        thread.join()
        return super().step(problem, memory)


PARTS = {
    "threaded": lambda scenario: Threaded(),
    "interrupting": lambda scenario: Mine(raising(KeyboardInterrupt())),
    "interrupted": lambda scenario: Mine(lambda problem: signal.raise_signal(signal.SIGINT)),
}


@pytest.mark.parametrize(
    ("name", "code", "says"),
    [
        ("threaded", 1, "error: threaded: the governor raised ValueError in a thread of its own: in a thread\n"),
        ("interrupting", 1, "error: interrupting: the governor raised KeyboardInterrupt in step: \n"),
        ("interrupted", 130, "interrupted; the log so far: a.mcap\n"),
    ],
)
def test_threads_and_interrupts_of_a_plug_in_are_its_own(name, code, says, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("tests.test_plugin_contracts.build", PARTS[name], raising=False)
    entry = EntryPoint(name, "tests.test_plugin_contracts:build", plugins.GOVERNOR.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry] if group == plugins.GOVERNOR.group else [])
    monkeypatch.chdir(tmp_path)
    arguments = ["paper/simulation_near", "--duration", "1", "--set", f"governor.kind={name}", "-o", "a.mcap"]
    assert main(["run", *arguments, "--quiet"]) == code
    assert capsys.readouterr() == ("", says)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def print_everywhere(problem):
    print("from Python")
    os.write(1, b"from a descriptor\n")
    ctypes.CDLL(None).puts(b"from C")
    subprocess.run(["echo", "from a program"], check=True)


def build_talkative(scenario):
    print("while it is built")
    return Mine(print_everywhere)


@pytest.mark.parametrize("arguments", [["--json"], ["--quiet"]])
def test_what_a_plug_in_prints_does_not_mix_with_answers(arguments, tmp_path, monkeypatch):
    entry = EntryPoint("talkative", "tests.test_plugin_contracts:build_talkative", plugins.GOVERNOR.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry] if group == plugins.GOVERNOR.group else [])
    monkeypatch.chdir(tmp_path)
    asked = ["paper/simulation_near", "--duration", "0.05", "--set", "governor.kind=talkative", "-o", "a.mcap"]
    ended = run_apart(lambda: main(["run", *asked, *arguments]))
    assert ended.code == 0, ended.stderr
    if "--json" in arguments:
        assert json.loads(ended.stdout)["governor"] == "talkative"
    else:
        assert ended.stdout == ""
    printed = {"while it is built", "from Python", "from a descriptor", "from C", "from a program"}
    assert printed <= set(ended.stderr.splitlines())


def test_in_python_it_prints_where_it_likes(capsys):
    list(pbrg.simulate(plan(duration=0.02), Mine(lambda problem: print("from Python"))))
    assert capsys.readouterr() == ("from Python\n", "")


class Solver(ClarabelSolver):
    def __init__(self, **changes):
        super().__init__()
        self.changes = changes

    def solve(self, problem):
        return super().solve(problem)._replace(**self.changes)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"status": "done"}, "status is 'done'; allowed: solved, infeasible, failed"),
        ({"status": Equal()}, "allowed: solved"),
        ({"solver_status": 7}, "solver_status is int; allowed: text"),
        ({"m": np.zeros(2, dtype=complex)}, "m is no array of float64"),
        ({"cost": "low"}, "cost is no array of float64"),
        ({"cost": np.inf}, "cost is not finite"),
        ({"solve_seconds": -1.0}, "solve_seconds is -1.0; allowed: a number from 0 on"),
        ({"build_seconds": None}, "build_seconds is None"),
        ({"multipliers": np.zeros(3)}, "multipliers has shape"),
    ],
)
def test_every_part_of_an_optimum_is_checked(changes, says):
    assert says in ended_by(None, reference_solver=Solver(**changes))


class Rows:
    def __init__(self, change):
        self.change, self.calls = change, 0

    def rows(self, half_spaces):
        self.calls += 1
        return self.change(ball_rows(half_spaces, np.zeros((5, 2))), half_spaces)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda rows, _: rows._replace(d=rows.d * np.nan), "hold a number that is not finite"),
        (lambda rows, _: rows._replace(a=-rows.a), "a has a negative weight"),
        (lambda rows, _: rows._replace(d=rows.d + 1e300), "d is larger than 1e+09"),
        (lambda rows, _: rows._replace(active=rows.active * 2), "active is "),
        (lambda rows, _: rows._replace(C=rows.C * 1j), "C is no array of float64"),
        (lambda rows, _: rows._replace(along=rows.C * 2), "along has a vector that is not of length 1"),
        (lambda rows, _: rows._replace(along=rows.C[:1]), "along has shape"),
        (
            lambda rows, half_spaces: half_spaces.h.fill(0.0),
            "raised ValueError in rows: assignment destination is read-",
        ),
    ],
)
def test_every_part_of_rows_is_checked(change, says):
    assert says in ended_by(None, certificate=Rows(change))


class Walls:
    """One wall, changed by a function of the tick."""

    def __init__(self, change):
        self.change = change

    def init(self):
        return 0

    def step(self, readings, time, memory):
        known = HalfSpaces.empty(5, 4)
        known.G[0, 0], known.h[0, 0], known.active[0, 0], known.binds[0, 0] = (1.0, 0.0), 3.0, True, True
        self.change(known, memory, readings)
        return known, memory + 1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda known, tick, _: known.G.fill(np.nan), "a normal not of length 1"),
        (lambda known, tick, _: known.h.fill(np.nan), "an h that is not finite"),
        (lambda known, tick, _: known.h.fill(1e300), "h is larger than 1e+09"),
        (lambda known, tick, _: known.binds.fill(True), "binds is true in a slot that is not active"),
        (
            lambda known, tick, readings: readings.body_pose.fill(0.0),
            "raised ValueError in step: assignment destination",
        ),
        (lambda known, tick, _: sys.exit(0), "raised SystemExit in step: 0"),
    ],
)
def test_every_part_of_half_spaces_is_checked(change, says):
    assert says in ended_by(None, estimator=Walls(change))


def test_half_spaces_that_change_in_place_are_seen():
    known = HalfSpaces.empty(5, 4)
    known.G[0, 0], known.active[0, 0], known.binds[0, 0] = (1.0, 0.0), True, True

    class Moving(Walls):
        def step(self, readings, time, memory):
            known.h[0, 0] = 3.0 + memory
            return known, memory + 1

    seen = [record.half_spaces.h[0, 0] for record in pbrg.simulate(plan(duration=0.05), estimator=Moving(None))]
    assert seen == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]


class Noise:
    def __init__(self, pose):
        self.answer = pose

    def scan(self, ranges, random):
        return ranges

    def pose(self, pose, random):
        return self.answer(pose)


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        (lambda pose: pose * np.nan, "pose is not finite"),
        (lambda pose: pose * 1j, "pose is no array of float64"),
        (lambda pose: pose + 1e300, "pose is larger than 1e+09"),
        (lambda pose: pose.fill(0.0), "read-only"),
        (lambda pose: sys.exit(0), "raised SystemExit in pose: 0"),
    ],
)
def test_every_pose_of_a_noise_model_is_checked(pose, says):
    with pytest.raises(PlugInError) as caught:
        list(pbrg.simulate(pbrg.load("paper/experiment_near", duration=0.02), noise_model=Noise(pose)))
    assert says in str(caught.value)


class Balanced(Mine):
    def __init__(self, balance):
        super().__init__()
        self.balance = balance

    def flow_passivity(self, problem, memory):
        return self.balance(problem)


@pytest.mark.parametrize(
    ("balance", "says"),
    [
        (lambda problem: 3, "flow_passivity returned int, not Passivity"),
        (lambda problem: Passivity("a", 0, 0, 0), "primal_storage is no array of float64"),
        (lambda problem: problem.p.fill(0.0), "raised ValueError in flow_passivity"),
        (lambda problem: sys.exit(0), "raised SystemExit in flow_passivity: 0"),
    ],
)
def test_balances_are_checked(balance, says):
    assert says in ended_by(Balanced(balance))


def test_a_metric_that_leaves_or_overflows_is_named(tmp_path):
    run = pbrg.run(plan(duration=0.05))
    with pytest.raises(PlugInError, match="<lambda>: the metric raised SystemExit in its function: 0"):
        run.metric(lambda run: sys.exit(0))
    with pytest.raises(PlugInError, match="<lambda>: the metric raised OverflowError in its numbers"):
        run.metric(lambda run: 10**400)


def test_the_scenario_a_part_is_built_from_is_a_copy(leaving, monkeypatch):
    def build(scenario):
        scenario.governor.options["gain"] = 3
        object.__setattr__(scenario.timing, "tick", 7.0)
        return Mine()

    monkeypatch.setattr(plugins, "find", lambda kind, name: build)
    made = plan("governor.kind=leaving")
    list(pbrg.simulate(made))
    assert made.settings.governor.options == {}
    assert made.settings.timing.tick == 0.01


def test_sealed_copies_are_deep_and_whole_floats_are_counts():
    rows = ball_rows(HalfSpaces.empty(2, 1), np.zeros((2, 2)))
    assert not any(array.flags.writeable for array in read_only_copy(rows))
    assert all(array.flags.writeable for array in rows)
    assert copied("a", "b", np.array([1.0, 2.0]), (2,), np.int64).tolist() == [1, 2]
