"""`pbrg tune`: the search against a known optimum, the same trace at every repetition, errors in one line."""

from __future__ import annotations

import json

import pytest

from tests.needs import need_module

need_module("optuna")

import pbrg_mj as pbrg  # noqa: E402
from pbrg_mj.cli.main import main  # noqa: E402
from pbrg_mj.scenario.families.schema import Distribution  # noqa: E402
from pbrg_mj.studies.optimizer import Optimizer  # noqa: E402

SMALL = """\
scenario: paper/simulation_near
seeds: 1,2
held_out: 3
duration: 1
set: {reference.solver: none, governor.kind: none}
keys: {control.alpha_r: {uniform: [0.2, 3]}}
minimize: terminal_gap_m
budget: 6
batch_size: 2
seed: 3
"""


def written(folder, text):
    (folder / "given.yaml").write_text(text)
    return folder / "given.yaml"


@pytest.mark.parametrize("seed", [1, 11])
def test_the_search_finds_a_known_optimum(seed):
    keys = {
        "x": Distribution(uniform=(-2.0, 2.0)),
        "y": Distribution(log_uniform=(1e-3, 1e3)),
        "kind": Distribution(choice=("bad", ["good"])),
    }
    optimizer, best = Optimizer(keys, seed), 1e9
    for _ in range(25):
        asked = optimizer.ask(4)
        values = [
            abs(point["x"] - 0.5) + abs(len(str(point["y"])) and point["y"] > 1.0) + (point["kind"] == "bad")
            for _, point in asked
        ]
        optimizer.tell([(trial, value) for (trial, _), value in zip(asked, values, strict=True)])
        best = min(best, *values)
    assert best < 0.05


def test_a_tuning_is_the_best_of_its_trace_and_the_same_again(tmp_path, capsys):
    file = written(tmp_path, SMALL)
    made = pbrg.tune(file, tmp_path / "out", jobs=1)
    assert len(made.trace) == 6 and made.trace[0]["keys"] == {}
    assert made.best["value"] == min(trial["value"] for trial in made.trace) < made.trace[0]["value"]
    gap = [
        pbrg.run(
            pbrg.load("paper/simulation_near", {**made.best["keys"], "governor.kind": "none"}, seed=seed, duration=1)
        )
        for seed in (1, 2)
    ]
    assert made.best["value"] == pytest.approx(sum(one.metrics.terminal_gap_m for one in gap) / 2, rel=1e-12)
    facts = json.loads((tmp_path / "out" / "trace.json").read_text())
    assert (facts["budget"], facts["seeds"], facts["held_out_seeds"]) == (6, [1, 2], [3])
    assert facts["held_out"]["best"] < facts["held_out"]["as_given"]
    # After a kill: some runs are there, the trace is the same.
    lines = (tmp_path / "out" / "runs.jsonl").read_bytes().splitlines(keepends=True)
    again = tmp_path / "again"
    again.mkdir()
    (again / "tune.yaml").write_text(SMALL)
    (again / "runs.jsonl").write_bytes(b"".join(lines[:6]))
    assert main(["tune", str(file), "-o", str(again), "--jobs", "1"]) == 0
    assert capsys.readouterr().out.startswith("best of 6 trials: ")
    for name in ("trace.json", "best.yaml", "records.parquet"):
        assert (again / name).read_bytes() == (tmp_path / "out" / name).read_bytes(), name


WRONG = {
    SMALL.replace("held_out: 3", "held_out: 2-4"): "3: held_out: has the seed 2",
    SMALL.replace("terminal_gap_m", "terminal_gap"): "7: minimize: is 'terminal_gap'",
    SMALL.replace("uniform: [0.2, 3]", "normal: [1, 1]"): "6: keys.control.alpha_r: cannot be searched",
    SMALL.replace("control.alpha_r", "control.alfa_r"): "6: keys.control.alfa_r: is unknown; did you mean `alpha_r`?",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_file_is_one_line(text, tmp_path, capsys):
    assert main(["tune", str(written(tmp_path, text)), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert WRONG[text] in said and said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_files_with_earlier_names_are_read_as_with_those_of_today(tmp_path, capsys):
    names = {"batch_size": "at_once", "failure_value": "otherwise"}
    today = SMALL.replace("terminal_gap_m", "settling_time_including_violated_s") + "failure_value: 5.0\n"
    earlier = today.replace("settling_time_including_violated_s", "settling_time_violated_too_s")
    for name, old in names.items():
        earlier = earlier.replace(f"{name}:", f"{old}:")
    made = []
    for folder, text in (("earlier", earlier), ("today", today)):
        given = tmp_path / folder
        given.mkdir()
        pbrg.tune(written(given, text), given / "out", jobs=1)
        made.append((given / "out" / "trace.json").read_bytes())
    assert made[0] == made[1]
    assert json.loads(made[0])["best"]["value"] == 5.0  # nothing settles in a second
    assert main(["tune", str(written(tmp_path, today + "at_once: 2\n")), "-o", str(tmp_path / "both")]) == 2
    line = len(today.splitlines()) + 1
    assert f":{line}: at_once: is the earlier name of `batch_size`" in capsys.readouterr().err
