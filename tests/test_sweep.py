"""`pbrg sweep`: which runs, their records against runs alone, resumption, failures as data, errors in one line."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys

import pytest
from pyarrow import parquet

import pbrg_mj as pbrg
from pbrg_mj.analysis.output_file import write_atomically
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.studies.document import read_study
from pbrg_mj.studies.run_task import run_task
from pbrg_mj.studies.sweep_plan import SweepKeys, plan
from tests.needs import need_module

SMALL = """\
scenario: paper/simulation_near
seeds: 3,5
duration: 0.2
set: {reference.solver: none}
variants:
  governor:
    paper: {governor.kind: distributed, governor.rounds: 2}
    none: {governor.kind: none}
grid:
  control.alpha_r: [0.5, 1.5]
random: {count: 2, seed: 4, keys: {team.heading_deg: {uniform: [0, 90]}}}
"""
# 0.2 s does not go into a period of 0.1 s, but every value goes with the first one of the other.
HALF_FAILS = """\
scenario: paper/simulation_near
duration: 0.4
grid: {timing.tick: [0.1, 0.2], reference.period: [0.2, 0.1]}
"""


def written(folder, text):
    (folder / "given.yaml").write_text(text)
    return folder / "given.yaml"


def table(folder):
    return parquet.read_table(folder / "records.parquet").to_pylist()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    return pbrg.sweep(written(folder, SMALL), folder / "out", jobs=1)


def test_the_plan_is_the_product_with_seeds_fastest(tmp_path):
    tasks = plan(read_study(written(tmp_path, SMALL), SweepKeys))
    assert len(tasks) == 2 * 2 * 2 * 2
    assert [task.seed for task in tasks[:4]] == [3, 5, 3, 5]
    assert [task.labels["draw"] for task in tasks[:4]] == [0, 0, 1, 1]
    assert [task.labels["keys.control.alpha_r"] for task in tasks[::4]] == [0.5, 1.5] * 2
    assert [task.labels["variants.governor"] for task in tasks[::8]] == ["paper", "none"]
    headings = {(task.labels["draw"], task.settings["team.heading_deg"]) for task in tasks}
    assert len(headings) == 2 and all(0 <= heading <= 90 for _, heading in headings)
    assert len({task.digest for task in tasks}) == len(tasks)


def test_a_record_is_what_the_run_alone_gives(made):
    records = table(made.folder)
    assert [record["run"] for record in records] == list(range(16))
    one = records[7]  # the second variant follows at 8
    overrides = {
        "governor.kind": "distributed",
        "governor.rounds": 2,
        "control.alpha_r": one["keys.control.alpha_r"],
        "team.heading_deg": one["keys.team.heading_deg"],
        "reference.solver": "none",
    }
    alone = pbrg.run(pbrg.load("paper/simulation_near", overrides, seed=5, duration=0.2)).metrics.as_dict()
    assert (one["seed"], one["variants.governor"], one["status"], one["error"]) == (5, "paper", "ok", None)
    for name in ("outcome", "terminal_gap_m", "true_margin_min_m", "xi_max_m", "sent_per_robot_total_bytes"):
        assert one[name] == alone[name], name
    assert one["consensus_spread_m.mean"] == alone["consensus_spread_m"]["mean"] > 0
    assert "governor_ms.median" not in one and "log" not in one


def test_what_is_there_is_not_run_again_and_a_torn_line_is(made, tmp_path):
    """As after a kill in the middle of a line, and of whole runs before it."""
    whole = (made.folder / "runs.jsonl").read_bytes().splitlines(keepends=True)
    out = tmp_path / "out"
    out.mkdir()
    (out / "sweep.yaml").write_text(SMALL)
    (out / "runs.jsonl").write_bytes(b"".join([whole[0], *whole[4:]])[:-20])
    seen = []
    pbrg.sweep(written(tmp_path, SMALL), out, jobs=1, watch=lambda *numbers: seen.append(numbers))
    assert seen == [(done, 16, 0) for done in range(12, 17)]
    assert (out / "records.parquet").read_bytes() == (made.folder / "records.parquet").read_bytes()
    pbrg.sweep(written(tmp_path, SMALL), out, jobs=1, watch=lambda *numbers: seen.append(numbers))
    assert seen[5:] == [(16, 16, 0)]


def test_what_a_killed_study_left_half_written_goes_when_it_goes_on(tmp_path):
    file = written(tmp_path, SMALL.replace("seeds: 3,5", "seeds: 3\nlogs: true").replace("count: 2", "count: 1"))
    folder = pbrg.sweep(file, tmp_path / "out", jobs=1).folder
    names = sorted(folder.rglob("*"))

    def be_killed(whole):
        whole.write_bytes(b"half")
        os.kill(os.getpid(), signal.SIGKILL)

    for place in (folder / "records.parquet", folder / "logs" / "any.mcap"):
        child = os.fork()
        if not child:
            write_atomically(place, be_killed)
        assert os.waitpid(child, 0)[1] == signal.SIGKILL
    assert len(sorted(folder.rglob("*"))) == len(names) + 2
    pbrg.sweep(file, folder, jobs=1)
    assert sorted(folder.rglob("*")) == names


def test_a_run_whose_log_nobody_wants_makes_no_folder(tmp_path, monkeypatch):
    """Nobody would remove it where the process is killed."""
    task = plan(read_study(written(tmp_path, SMALL), SweepKeys))[0]
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    assert run_task(task).record["status"] == "ok"


def test_a_run_that_fails_is_a_record(tmp_path, capsys):
    assert (
        main(["sweep", str(written(tmp_path, HALF_FAILS)), "-o", str(tmp_path / "out"), "--jobs", "1", "--json"]) == 0
    )
    assert json.loads(capsys.readouterr().out)["failed"] == 1
    ended = {(one["keys.timing.tick"], one["keys.reference.period"]): one for one in table(tmp_path / "out")}
    failed = ended.pop((0.2, 0.1))
    assert failed["status"] == "failed" and failed["error"].startswith("InputError: ") and failed["ticks"] is None
    assert [one["status"] for one in ended.values()] == ["ok"] * 3


def test_logs_are_those_of_the_records_and_verify(tmp_path):
    text = "{scenario: paper/simulation_near, duration: 0.1, logs: true, seeds: [7]}"
    made = pbrg.sweep(written(tmp_path, text), tmp_path / "out", jobs=1)
    log = tmp_path / "out" / "logs" / "0.mcap"
    assert pbrg.open(log).metrics.terminal_gap_m == made.records[0]["terminal_gap_m"]
    assert pbrg.verify(log).verdict == "identical"
    before = log.read_bytes()
    log.unlink()
    pbrg.sweep(written(tmp_path, text), tmp_path / "out", jobs=1)  # a record without its log is made again
    assert len(log.read_bytes()) > 0.9 * len(before)


WRONG = {
    "scenario: paper/simulation_nea": "1: scenario: 'paper/simulation_nea' is neither",
    "scenario: paper/simulation_near\nseeds: 8-1": "2: seeds: is '8-1'",
    "scenario: paper/simulation_near\nseed: 1": "2: seed: is unknown; did you mean `seeds`?",
    "scenario: paper/simulation_near\ngrid:\n  governor.runds: [1]": "3: grid.governor.runds.0: is unknown",
    "scenario: paper/simulation_near\ngrid:\n  governor.rounds:\n  - 1\n  - none": "5: grid.governor.rounds.1: ",
    "scenario: paper/simulation_near\nset: {governor.rounds: 0}": "2: set.governor.rounds: is 0; allowed",
    "scenario: paper/simulation_near\nset: {log.timings: true}\ngrid: {log.timings: [true]}": "3: grid.log.timings",
    "scenario: paper/simulation_near\ngrid: {governor.rounds: []}": "2: grid.governor.rounds: is empty",
    "scenario: paper/simulation_near\nvariants:\n  a:\n    b: {governor.kind: x}": "4: variants.a.b: governor.kind: ",
    "scenario: paper/simulation_near\nrandom: {count: 1, keys: {seed: {uniform: [3, 1]}}}": "2: random.keys.seed",
    "scenario: paper/simulation_near\nseeds: 1-99999\nrandom: {count: 11, keys: {a: {choice: [1]}}}": "asks for",
    "scenario: !!python/object:os.system x": "1: scenario: has the tag",
    "- 1": "1: is [1]; allowed",
}  # fmt: skip


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_file_is_one_line_with_line_and_key_and_leaves_nothing(text, tmp_path, capsys):
    file = written(tmp_path, text)
    assert main(["sweep", str(file), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {file}") and said.count("\n") == 1
    assert WRONG[text] in said, said
    assert not (tmp_path / "out").exists()


def test_another_file_or_other_code_is_refused_until_force(made, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    lines = (made.folder / "runs.jsonl").read_text().splitlines()
    (out / "sweep.yaml").write_text(SMALL)
    (out / "runs.jsonl").write_text(json.dumps({**json.loads(lines[0]), "numpy": "1.0"}) + "\n")
    with pytest.raises(InputError, match="made with another numpy; allowed: a new folder, or --force"):
        pbrg.sweep(written(tmp_path, SMALL), out)
    shorter = SMALL.replace("3,5", "3").replace("count: 2", "count: 1")
    with pytest.raises(InputError, match="is another one by now"):
        pbrg.sweep(written(tmp_path, shorter), out)
    assert len(pbrg.sweep(written(tmp_path, shorter), out, jobs=1, force=True)) == 4


def test_a_journal_that_is_no_file_is_refused_and_stays(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "sweep.yaml").write_text(SMALL)
    os.mkfifo(folder / "runs.jsonl")
    with pytest.raises(pbrg.InputError, match=r"runs\.jsonl: is no file; allowed: a new folder"):
        pbrg.sweep(written(tmp_path, SMALL), folder, jobs=1)
    assert (folder / "runs.jsonl").is_fifo()


def test_options_of_backends_are_refused_in_one_line(tmp_path):
    file = written(tmp_path, SMALL)
    with pytest.raises(InputError, match=r"^backend: is 'slurm'; allowed: joblib, dask$"):
        pbrg.sweep(file, tmp_path / "out", backend="slurm")
    with pytest.raises(InputError, match=r"^scheduler: is missing"):
        pbrg.sweep(file, tmp_path / "out", backend="dask")
    with pytest.raises(InputError, match=r"^scheduler: is for the backend dask alone"):
        pbrg.sweep(file, tmp_path / "out", scheduler="tcp://localhost:1")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere", "nowhere://x", "tcp://127.0.0.1:{}"])
def test_a_scheduler_that_does_not_answer_leaves_no_folder(address, tmp_path, capfd, monkeypatch):
    """Nobody is there, the address is none, or who is there says nothing."""
    need_module("distributed")
    monkeypatch.setattr("pbrg_mj.studies.backends.SCHEDULER_TIMEOUT", 0.3)
    file, out = str(written(tmp_path, SMALL)), tmp_path / "out"
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = address.format(silent.getsockname()[1])
        assert main(["sweep", file, "-o", str(out), "--backend", "dask", "--scheduler", address]) == 2
    said = capfd.readouterr().err
    assert said.startswith(f"error: scheduler: no scheduler answers at '{address}': ") and said.count("\n") == 1
    assert not out.exists()


def test_a_folder_is_one_sweeps_at_a_time(made, tmp_path):
    from pbrg_mj.studies.journal import Journal
    from pbrg_mj.studies.run_task import packages

    with Journal(tmp_path, packages()), pytest.raises(InputError, match="another study writes"), Journal(tmp_path, {}):
        pass


@pytest.mark.slow
def test_processes_give_the_same_bytes(made, tmp_path):
    pbrg.sweep(written(tmp_path, SMALL), tmp_path / "out", jobs=2)
    assert (tmp_path / "out" / "records.parquet").read_bytes() == (made.folder / "records.parquet").read_bytes()


@pytest.mark.slow
def test_a_warning_stands_once_and_in_one_line_whatever_the_number_of_processes(tmp_path):
    """Numba's, whose text has a traceback: each process would print it again, in ten lines."""
    text = "scenario: paper/simulation_near\nseeds: 1-2\nduration: 0.1\nset: {plant: ideal, reference.solver: none}\n"
    program = "import sys; from pbrg_mj.cli.main import main; sys.exit(main())"
    arguments = ["sweep", str(written(tmp_path, text)), "-o", str(tmp_path / "out"), "--jobs", "2"]
    environment = os.environ | {"NUMBA_BOUNDSCHECK": "perhaps"}
    command = [sys.executable, "-c", program, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    (line,) = done.stderr.splitlines()
    assert line.startswith("warning: Environment variable 'NUMBA_BOUNDSCHECK' is defined")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of the cluster that loses a worker
def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(made, tmp_path):
    distributed = need_module("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        killed = []

        def kill_one(done, _total, _failed):
            if done >= 3 and not killed:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        file = written(tmp_path, SMALL)
        pbrg.sweep(file, tmp_path / "out", backend="dask", scheduler=cluster.scheduler_address, watch=kill_one)
    assert killed
    assert (tmp_path / "out" / "records.parquet").read_bytes() == (made.folder / "records.parquet").read_bytes()
