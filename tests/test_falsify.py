"""`pbrg falsify`: planted failures are found and shrunk, governors without them are not blamed."""

from __future__ import annotations

import json
import signal

import pytest

from tests.needs import need_module

need_module("optuna")

import pbrg_mj as pbrg  # noqa: E402
from pbrg_mj.cli.main import main  # noqa: E402
from pbrg_mj.errors import Stopped  # noqa: E402
from pbrg_mj.scenario.parse.document import read_document  # noqa: E402
from pbrg_mj.studies.failures import FAILURES  # noqa: E402
from pbrg_mj.studies.run_task import Result, packages  # noqa: E402
from pbrg_mj.studies.runner import Runner  # noqa: E402
from pbrg_mj.studies.shrink import shrunk  # noqa: E402
from pbrg_mj.studies.task import Source, Task  # noqa: E402

# Three robots without governor. Only a reference far to the right, beyond the wall, makes one cross.
TEAM = """\
plant: ideal
timing: {duration: 6.0, tick: 0.05, physics_step: 0.05}
team: {start: [[0, 0], [0, 1], [0, -1]], formation: [[0, 0], [0, 1], [0, -1]], leaders: [1]}
world:
  walls: [{from: [1.0, -6], to: [1.0, 6]}, {from: [-9, -6], to: [-9, 6]}]
  columns: [{center: [-5, 4], radius: 0.2}]
estimator: {source: given, given: [{robot: 1, normal: [1, 0], offset: 90}]}
governor: {kind: none}
reference: {solver: none}
operator: {reference: [0, 0]}
"""
SEARCH = "find: crossing\nkeys: {operator.reference: {choice: [[0, 0.5], [0, -0.5], [-0.5, 0], [3, 0]]}}\nseed: 2\n"


@pytest.fixture
def files(tmp_path):
    (tmp_path / "team.yaml").write_text(TEAM)
    (tmp_path / "search.yaml").write_text(SEARCH)
    return str(tmp_path / "team.yaml"), str(tmp_path / "search.yaml"), str(tmp_path / "out")


def test_a_planted_crossing_is_found_shrunk_and_ready_to_run(files, tmp_path, capsys):
    team, search, out = files
    arguments = ["falsify", team, "--search", search, "-o", out, "--budget", "30", "--jobs", "1"]
    assert main([*arguments, "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["nearest"] < 0 and said["runs"] <= 30
    found = pbrg.load(tmp_path / "out" / "found.yaml")
    assert found.settings.description == "A failure of team, made shorter"
    assert found.settings.operator.reference == (3, 0)
    assert len(found.settings.world.all_obstacles) == 1 and found.settings.world.walls[0].start == (1.0, -6)
    assert found.settings.robots == 1
    run = pbrg.run(found)
    assert run.metrics.true_margin_min_m < 0
    assert 0 <= found.settings.timing.duration - run.metrics.violation_time_s + 1e-9 <= 0.15
    before = (tmp_path / "out" / "records.parquet").read_bytes()
    assert main(arguments) == 1  # again: the same, and no run is made twice
    assert " with 1 robot, after " in capsys.readouterr().out
    assert (tmp_path / "out" / "records.parquet").read_bytes() == before


class OutOfOrder:
    """A backend whose runs end in an order of their own; says which were asked for before it was closed."""

    def __init__(self, order):
        self.order, self.given = order, []

    def check(self):
        pass

    def run(self, tasks, keep_logs):
        for seed in self.order:
            self.given.append(seed)
            task = next(one for one in tasks if one.seed == seed)
            yield Result(task.digest, {"status": "ok", "value": seed % 2}, {}, packages())


@pytest.mark.parametrize(
    ("order", "asked_for"),
    [((4, 2, 6, 3, 5, 8), [4, 2, 6, 3]), ((5, 3, 4, 2, 6, 8), [5, 3, 4, 2]), ((2, 4, 3, 5), [2, 4, 3])],
)
def test_the_first_run_that_ends_a_search_ends_it_whatever_comes_first(order, asked_for, tmp_path):
    """Runs of the seeds 2, 4, 3, 5, 6, 8, of which odd ones fail: the first is that of 3."""
    source = Source("team", TEAM, "team.yaml", "team.yaml")
    tasks = [Task(source, {}, seed) for seed in (2, 4, 3, 5, 6, 8)]
    for again in (False, True):  # from the journal alone
        backend = OutOfOrder(order)
        with Runner(tmp_path, ("search.yaml", b""), backend) as runner:
            results = runner.run(tasks, ends=lambda record: record["value"] == 1)
        assert [record["value"] for record, _ in results] == [0, 0, 1]
        assert backend.given == ([] if again else asked_for)


class RunsUntil:
    """Instant runs of a backend, until one raises; the last one before `failing` others crosses the line."""

    def __init__(self, monkeypatch, runs, error, failing=10**9):
        self.left, self.error, self.failing = runs, error, failing
        monkeypatch.setattr("pbrg_mj.studies.backends.run_task", self.run)

    def run(self, task, keep_logs):
        if self.left == 0:
            raise self.error
        self.left, self.failing = self.left - 1, self.failing - 1
        record = {"status": "ok", "true_margin_min_m": 1.0 if self.failing else -1.0, "asked_s": 6.0}
        return Result(task.digest, record | {"violation_time_s": 1.0}, {}, packages())


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (Stopped(signal=signal.SIGTERM), 143), (Stopped(), 130)]
)
def test_an_interrupted_search_tells_all_that_is_finished_and_repeats_none_of_it(
    files, error, code, tmp_path, monkeypatch, capsys
):
    team, search, out = files
    (tmp_path / "search.yaml").write_text("find: crossing\nkeys: {control.alpha_r: {uniform: [0.5, 2]}}\n")
    arguments = ["falsify", team, "--search", search, "-o", out, "--budget", "30", "--jobs", "1"]
    for runs, over in ((6, "6 of 30 runs"), (0, "6 of 30 runs"), (5, "11 of 30 runs")):
        RunsUntil(monkeypatch, runs, error)
        assert main(arguments) == code
        assert capsys.readouterr().err == f"interrupted; {out} has {over}; the same command continues from there\n"
    RunsUntil(monkeypatch, 4, error, failing=2)  # the 13th is the failure, two are to make it shorter
    assert main(arguments) == code
    assert f"{out} has 15 runs; " in capsys.readouterr().err
    assert sorted(one.name for one in (tmp_path / "out").iterdir()) == ["runs.jsonl", "search.yaml"]


@pytest.mark.slow
def test_processes_find_the_same_and_leave_no_files(files, tmp_path, monkeypatch, capsys):
    team, search, out = files
    place = tmp_path / "place"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))
    for jobs in "12":
        assert main(["falsify", team, "--search", search, "-o", out + jobs, "--jobs", jobs]) == 1
    one, two = ((tmp_path / f"out{jobs}" / "records.parquet").read_bytes() for jobs in "12")
    assert one == two
    assert not list(place.glob("pbrg-*"))


def test_what_does_not_fail_is_not_blamed(files, tmp_path, capsys):
    team, search, out = files
    (tmp_path / "search.yaml").write_text(SEARCH.replace(", [3, 0]", ""))
    assert main(["falsify", team, "--search", search, "-o", out, "--budget", "5", "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("no crossing in 5 runs; the nearest one by ")
    assert float(said.split()[-1]) == pytest.approx(0.85, abs=0.05)  # from x = 0 to the face at 0.95, less 0.1
    assert not (tmp_path / "out" / "found.yaml").exists()


def test_values_are_below_0_where_the_failure_is():
    well = {
        "wall_contacts": 0, "moving_contacts": 0, "robot_contacts": 0, "robot_gap_min_m": 0.3, "true_margin_min_m": 0.2,
        "own_certificate": "predictive", "predictive_worst_m": -0.01, "outcome": "converged", "terminal_gap_m": 0.01,
    }  # fmt: skip
    bad = {
        "contact": {"robot_contacts": 2},
        "crossing": {"true_margin_min_m": -0.01},
        "certificate": {"predictive_worst_m": 0.002},
        "stall": {"outcome": "stuck", "terminal_gap_m": 0.7},
    }
    for kind, value in FAILURES.items():
        assert value(well) > 0, kind
        assert value(well | bad[kind]) < 0, kind
        assert all(value(well | others) > 0 for other, others in bad.items() if other != kind and kind != "stall"), kind
    assert FAILURES["contact"](well) == 0.3
    assert FAILURES["crossing"](well | {"true_margin_min_m": -3e-8}) > 0  # on the line, but for rounding
    assert FAILURES["certificate"](well | {"own_certificate": None, "certificate_worst_m": 0.1}) == pytest.approx(
        -0.1, abs=1e-5
    )


def test_shrinking_keeps_what_the_failure_needs():
    """A failure that needs robot 2, any one wall and 3 s: the smallest scenario has these alone."""
    scenario = pbrg.load(_parsed(TEAM.replace("leaders: [1]", "leaders: [1, 2]")))

    def run(text, seed):
        one = pbrg.load(_parsed(text)).settings
        fails = (0.0, 1.0) in one.team.start and one.world.walls and one.timing.duration >= 3.0
        return {"status": "ok", "fails": bool(fails), "asked_s": one.timing.duration, "violation_time_s": None}

    first = {"status": "ok", "fails": True, "asked_s": 6.0, "violation_time_s": None}
    text, record, runs = shrunk(scenario, first, lambda record: -1.0 if record["fails"] else 1.0, 60, run)
    small = pbrg.load(_parsed(text)).settings
    assert record["fails"] and runs <= 60
    assert small.team.start == ((0.0, 1.0),) and small.team.leaders == (1,)
    assert (len(small.world.walls), len(small.world.columns), small.timing.duration) == (1, 0, 3.0)


def _parsed(text):
    return read_document(text, "scenario").data


def test_a_wrong_search_is_one_line(files, tmp_path, capsys):
    team, search, out = files
    for text, said in {
        SEARCH.replace("crossing", "cross"): "1: find: is 'cross'; allowed: one of contact, crossing",
        SEARCH.replace("operator.reference", "operator.referense"): "2: keys.operator.referense: is unknown",
    }.items():
        (tmp_path / "search.yaml").write_text(text)
        assert main(["falsify", team, "--search", search, "-o", out]) == 2
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()
