"""Metrics of a run without a log are those of its log, number by number."""

import pytest

import pbrg_mj as pbrg
from pbrg_mj.api.simulate import measure, record
from pbrg_mj.studies.run_task import numbers

IDEAL = "paper/simulation_inadmissible"
SCENARIOS = {
    "optima, ticks beyond a block": (IDEAL, {"timing.duration": 3.0, "reference.period": 0.05}),
    "no optima, no timings": (IDEAL, {"timing.duration": 0.5, "reference.solver": "none", "log.timings": False}),
    "diverges": (IDEAL, {"timing.duration": 1.0, "governor.step": 0.5}),
    "two ticks": (IDEAL, {"timing.duration": 0.01}),
}


def compared(name, settings, folder):
    scenario = pbrg.load(name).override(settings)
    return numbers(measure(scenario)), numbers(record(scenario, folder / "run.mcap"))


@pytest.mark.parametrize("case", SCENARIOS)
def test_metrics_without_a_log(case, tmp_path):
    name, settings = SCENARIOS[case]
    without, logged = compared(name, settings, tmp_path)
    assert without == logged


@pytest.mark.slow
def test_metrics_without_a_log_in_a_family_s_world(tmp_path):
    without, logged = compared("families/moving_boxes", {"seed": 3, "timing.duration": 2.0}, tmp_path)
    assert without == logged
    assert without["moving_margin_min_m"] is not None
