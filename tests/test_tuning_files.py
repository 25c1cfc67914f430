"""The sweeps behind the standard suite's governors: files that `pbrg tune` takes, as docs/bench.md says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.needs import need_module

need_module("optuna")

import pbrg_mj as pbrg  # noqa: E402
from pbrg_mj.studies.bench.suite import SuiteKeys, bundled_suites  # noqa: E402
from pbrg_mj.studies.document import plain, read_study  # noqa: E402
from pbrg_mj.studies.runner import Runner  # noqa: E402
from pbrg_mj.studies.sweep_plan import seed_list  # noqa: E402
from pbrg_mj.studies.tune import TuneKeys  # noqa: E402

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "bench.md").read_text("utf-8")
SUITE = read_study(bundled_suites()["standard"], SuiteKeys)
TUNED = [name for name in SUITE.keys.governors if name != "none"]
DONE = {"status": "ok", "error": None, "outcome": "converged", "terminal_gap_m": 0.5}


def file_of(governor: str) -> Path:
    return DOCS / "data" / "tuning" / f"{governor.replace(' ', '_')}.yaml"


@pytest.mark.parametrize("governor", TUNED)
def test_each_sweep_is_a_file_that_tune_takes_with_the_budget_of_the_table(governor, tmp_path, monkeypatch):
    """Nothing runs: every scenario is read and checked with the first values, and all values are asked for."""
    ran = []
    monkeypatch.setattr(Runner, "run", lambda self, tasks, **given: ran.extend(tasks) or [(DONE, {})] * len(tasks))
    made = pbrg.tune(file_of(governor), tmp_path, jobs=1)
    assert len(made.trace) == int(re.search(rf"^\| {governor} \| (\d+) \|", PAGE, re.MULTILINE)[1])
    assert made.trace[0]["keys"] == {} and all(trial["keys"] for trial in made.trace[1:])
    assert len(ran) == 12 * (len(made.trace) + 2)  # worlds; the best and those as given in those of other seeds, too
    assert f"](data/tuning/{file_of(governor).name})" in PAGE


def test_no_file_is_there_that_the_page_does_not_name():
    assert set((DOCS / "data" / "tuning").iterdir()) == {file_of(governor) for governor in TUNED}


@pytest.mark.parametrize("governor", TUNED)
def test_what_is_tuned_is_what_the_suite_compares(governor):
    """The suite's settings but for what was swept, on its train seeds' worlds and never on its held-out ones."""
    sweep = read_study(file_of(governor), TuneKeys)
    given = plain(SUITE.keys.set) | plain(SUITE.keys.governors[governor].settings)
    swept = sweep.keys.keys
    known = {key: value for key, value in given.items() if key not in swept}
    fixed = plain(sweep.keys.set)
    assert {key: fixed.get(key) for key in known} == known
    assert set(sweep.keys.scenario) <= set(SUITE.keys.scenario)
    held_out = {
        seed + k * SUITE.keys.seed_stride
        for seed in seed_list(SUITE, "held_out")
        for k in range(len(SUITE.keys.scenario))
    }
    assert not held_out & {*seed_list(sweep, "seeds"), *seed_list(sweep, "held_out")}


def test_the_page_shows_a_file_as_it_is():
    shown = re.search(r"```yaml\n(# pbrg tune paper.*?)```", PAGE, re.DOTALL)[1]
    assert shown == file_of("paper").read_text("utf-8")
