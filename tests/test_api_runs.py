"""Runs through the Python API: in memory, into a log, tick by tick, with a governor of one's own."""

from __future__ import annotations

import gc
import os
import signal
import threading
from dataclasses import fields

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.table import LABEL_WIDTH, LAYOUT, WRAPPED, cell, look_up, sentences, shown
from pbrg_mj.cli.main import main
from pbrg_mj.log.read.run import open_run
from tests.needs import need_module


class Scaled:
    """A fixed share of the way to r, whatever the certificate says."""

    def __init__(self, gain):
        self.gain = gain

    def init(self, problem):
        return problem.p.mean(axis=0)

    def step(self, problem, start):
        return pbrg.Solution.of(problem, start + self.gain * (problem.reference - start)), start


@pytest.fixture(scope="module")
def scenario():
    return pbrg.load("paper/experiment_near", {"log.timings": False}, duration=1.5, seed=3)


@pytest.fixture(scope="module")
def logged(scenario, tmp_path_factory):
    return pbrg.run(scenario, log=tmp_path_factory.mktemp("logged") / "near.mcap")


@pytest.fixture(scope="module")
def kept(scenario):
    return pbrg.run(scenario)


def same(one, other):
    assert list(one) == list(other)
    for name in one:
        assert one[name].dtype == other[name].dtype, name
        assert one[name].tobytes() == other[name].tobytes(), name


def test_a_run_in_memory_is_the_logged_run_bit_for_bit(kept, logged, tmp_path):
    same(kept.arrays, logged.arrays)
    same(kept.optimum, logged.optimum)
    assert (kept.path, str(logged.path.name)) == (None, "near.mcap")
    assert kept.save(tmp_path / "kept.mcap").read_bytes() == logged.path.read_bytes()
    same(pbrg.open(tmp_path / "kept.mcap").arrays, logged.arrays)


def test_tick_by_tick_is_the_run(scenario, logged):
    ticks = list(pbrg.simulate(scenario))
    assert [tick.index for tick in ticks] == logged.tick.tolist()
    for name, values in {
        "q_true_m": [tick.truth.hand_world for tick in ticks],
        "q_m": [tick.hand_world for tick in ticks],
        "m_m": [tick.solution.m for tick in ticks],
        "xi_m": [tick.problem.xi for tick in ticks],
        "lambda": [tick.solution.multipliers for tick in ticks],
        "command_V": [tick.command for tick in ticks],
        "half_space_h_m": [tick.half_spaces.h for tick in ticks],
    }.items():
        np.testing.assert_array_equal(np.array(values), logged[name], err_msg=name)
    solved = np.array([tick.optimum.m for tick in ticks if tick.optimum is not None])
    np.testing.assert_array_equal(solved, logged.optimum.m_star_m)


def test_arrays_bear_the_exports_names(logged, tmp_path):
    logged.export(tmp_path / "near.npz")
    with np.load(tmp_path / "near.npz") as file:
        assert set(file) == set(logged.arrays)
        for name in file:
            np.testing.assert_array_equal(file[name], getattr(logged, name) if name != "lambda" else logged["lambda"])
    assert logged.q_true_m.shape == (151, 5, 2)
    assert "q_true_m" in dir(logged) and "m_star_m" in dir(logged.optimum)
    with pytest.raises(AttributeError, match="there is no array 'q_tru_m'; there are: tick, time_s, q_true_m"):
        _ = logged.q_tru_m
    with pytest.raises(KeyError):
        _ = logged["q_tru_m"]


def test_the_optimum_has_its_own_times(logged):
    np.testing.assert_array_equal(logged.optimum.time_s, logged.time_s[logged.optimum.reference_tick])
    assert logged.optimum.m_star_m.shape == (16, 2)
    assert set(logged.optimum) - {"time_s"} <= set(logged.arrays)


def test_the_commands_print_the_apis_numbers(logged, capsys):
    near = str(logged.path)
    for arguments, text in (
        (["compare", near], pbrg.compare(logged).table()),
        (["replay", near], "\n".join(logged.replay().lines())),
        (["replay", near, "--verify"], "\n".join(pbrg.verify(logged).lines())),
    ):
        assert main(arguments) == 0
        assert capsys.readouterr().out == text + "\n", arguments


def test_the_commands_table_holds_the_apis_metrics(logged, capsys):
    assert main(["compare", str(logged.path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    numbers = logged.metrics.as_dict()
    for label, key in (row for rows in LAYOUT.values() for row in rows):
        (k,) = (k for k, line in enumerate(lines) if line.startswith(f"  {label}  "))
        rows = [lines[k].removeprefix(f"  {label}")]
        while key in WRAPPED and lines[k + len(rows)].startswith(" " * LABEL_WIDTH):
            rows.append(lines[k + len(rows)])
        expected = " ".join(sentences(look_up(numbers, key))) if key in WRAPPED else cell(shown(numbers, key))
        assert " ".join(rows).split() == expected.split(), key


def test_the_command_runs_what_the_api_runs(scenario, logged, tmp_path, capsys):
    near = tmp_path / "near.mcap"
    overrides = ["--set", "log.timings=false", "--seed", "3", "--duration", "1.5"]
    assert main(["run", "paper/experiment_near", *overrides, "-o", str(near)]) == 0
    assert near.read_bytes() == logged.path.read_bytes()
    printed = capsys.readouterr().out.splitlines()
    assert printed[:-1] == logged.summary().splitlines()[:-1]  # the last line is the log's name
    assert printed[-1].split()[0] == "log"


def test_runs_compare_as_logs_do(kept, logged):
    both = pbrg.compare(kept, logged.path, logged.metrics)
    assert [one.terminal_gap_m for one in both] == [kept.metrics.terminal_gap_m] * 3
    assert [one["log"] for one in both.as_dicts()] == ["in memory", str(logged.path), str(logged.path)]
    assert repr(both) == both.table()
    assert not both.failed


def test_a_run_can_be_run_again_from_its_scenario(logged):
    same(pbrg.run(logged.scenario).arrays, logged.arrays)


def test_a_governor_object_governs_and_is_named_in_the_log(tmp_path, capsys):
    scenario = pbrg.load("paper/simulation_near", duration=0.5)
    path = tmp_path / "scaled.mcap"
    run = pbrg.run(scenario, Scaled(0.25), path)
    start = run.p_m[0].mean(axis=0)
    np.testing.assert_allclose(run.m_m, np.broadcast_to(start + 0.25 * (run.r_m[0] - start), run.m_m.shape))
    assert run.metrics.governor == "object:Scaled"
    assert main(["compare", str(path)]) == 0
    assert "object:Scaled" in capsys.readouterr().out
    ticks = list(pbrg.simulate(scenario, Scaled(0.25)))
    np.testing.assert_array_equal([tick.solution.m for tick in ticks], run.m_m)


def test_verifying_such_a_log_needs_the_object(tmp_path, capsys):
    path = tmp_path / "scaled.mcap"
    pbrg.run(pbrg.load("paper/simulation_near", duration=0.5), Scaled(0.25), path)
    assert main(["replay", str(path), "--verify"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "the governor was an object of the class Scaled" in said and "pbrg_mj.verify" in said
    assert pbrg.verify(path, Scaled(0.25)).verdict == "identical"
    assert pbrg.verify(path, Scaled(0.5)).verdict == "differs"


@pytest.mark.parametrize("governor", [Scaled, object(), "distributed"])
def test_what_is_no_governor_is_refused(governor):
    with pytest.raises(pbrg.InputError, match="is no governor; allowed: an object with the methods init and step"):
        pbrg.run("paper/simulation_near", governor)


@pytest.mark.parametrize(
    ("log", "says"), [("a.txt", "a log's name ends in .mcap"), ("nowhere/a.mcap", "there is no folder nowhere")]
)
def test_a_log_that_cannot_be_is_refused_before_the_run(log, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(pbrg.InputError, match=says):
        pbrg.run(pbrg.load("paper/simulation_near", duration=1e6), log=log)


def test_who_watches_sees_every_record_after_the_log(scenario, tmp_path):
    seen = []

    def watch(record):
        assert (tmp_path / "near.mcap.part").exists()
        seen.append(record.index)

    pbrg.run(scenario, log=tmp_path / "near.mcap", watch=[watch])
    assert seen == list(range(151))


def test_ctrl_c_leaves_a_whole_log_and_raises_interrupted(scenario, tmp_path):
    path = tmp_path / "near.mcap"

    def press(record):
        if record.index == 40:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(pbrg.Interrupted, match=r"the log so far: .*near\.mcap"):
        pbrg.run(scenario, log=path, watch=[press])
    left = open_run(path)
    assert (len(left.ticks.time), left.damage) == (41, None)
    assert left.ending_text == "interrupted (SIGINT)"
    assert issubclass(pbrg.Interrupted, KeyboardInterrupt)
    assert not issubclass(pbrg.Interrupted, Exception)


def test_a_run_leaves_signals_and_garbage_collection_as_they_were(scenario):
    before = (signal.getsignal(signal.SIGINT), gc.get_threshold(), gc.get_freeze_count(), dict(os.environ))
    pbrg.run(scenario)
    assert (signal.getsignal(signal.SIGINT), gc.get_threshold(), gc.get_freeze_count(), dict(os.environ)) == before


def test_a_run_in_a_thread_is_the_run(scenario, kept):
    made = []
    thread = threading.Thread(target=lambda: made.append(pbrg.run(scenario)))
    thread.start()
    thread.join()
    same(made[0].arrays, kept.arrays)


def test_a_batch_holds_every_seeds_run(tmp_path):
    scenario = pbrg.load("paper/experiment_near", duration=0.5)
    many = pbrg.batch(scenario, seeds=[4, 2], path=tmp_path / "two.npz", threads=1)
    for world, seed in enumerate((4, 2)):
        np.testing.assert_array_equal(many.hand_world_m[world], pbrg.run(scenario.override(seed=seed)).q_true_m)
    with np.load(tmp_path / "two.npz") as file:
        assert set(file) == set(many)
        for name in file:
            np.testing.assert_array_equal(file[name], many[name])
    assert many.summary()["worlds"] == 2 and not many.failed


def test_damage_is_warned_of_and_kept(logged, tmp_path, caplog):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(logged.path.read_bytes()[: int(0.7 * logged.path.stat().st_size)])
    run = pbrg.open(cut)
    assert run.damage and caplog.messages == [f"{cut}: {run.damage}"]
    kept = pbrg.repair(cut, tmp_path / "clean.mcap")
    assert kept.kept_ticks == len(run.time_s) and pbrg.open(kept.path).damage is None


def test_a_dataset_has_names_units_and_the_same_numbers(logged):
    need_module("xarray")
    data = logged.to_xarray()
    for name, values in logged.arrays.items():
        if name in data.variables:
            np.testing.assert_array_equal(data[name].values, values, err_msg=name)
    assert set(logged.arrays) - set(data.variables) == {"scenario_name", "scenario_yaml"}
    assert data.q_true_m.dims == ("tick", "robot", "xy")
    assert data.half_space_binds.dims == ("tick", "robot", "slot", "bound_robot")
    assert data["lambda"].dims == ("tick", "robot", "row")
    assert data.m_star_m.dims == ("reference_tick", "xy")
    assert data.command_V.dims == ("tick", "robot", "side")
    units = {name: data[name].units for name in ("q_true_m", "u_m_s", "storage_m2", "command_V", "rounds", "time_s")}
    expected = {"q_true_m": "m", "u_m_s": "m/s", "storage_m2": "m2", "command_V": "V", "rounds": "1", "time_s": "s"}
    assert units == expected
    one = data.q_true_m.sel(robot=5, xy="y")
    np.testing.assert_array_equal(one.values, logged.q_true_m[:, 4, 1])
    np.testing.assert_array_equal(data.reference_time_s, logged.optimum.time_s)
    assert data.attrs["scenario_name"] == "paper/experiment_near"


def test_wall_clock_is_in_the_dataset_where_the_log_has_it():
    need_module("xarray")
    run = pbrg.run(pbrg.load("paper/simulation_near", duration=0.2))
    np.testing.assert_array_equal(run.to_xarray().wall_clock_govern_s, run.wall_clock_govern_s)


def test_metrics_are_those_of_the_log(logged):
    for field in fields(logged.metrics):
        assert hasattr(logged.metrics, field.name)
    assert logged.metrics.as_dict() == pbrg.open(logged.path).metrics.as_dict()
    assert not logged.failed
    assert "experiment_near" in repr(logged) and "unfinished" in repr(logged)
