"""`pbrg validate` says what a run would be refused for when it is put together, in the same words."""

from __future__ import annotations

import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main

REFUSED = {
    "a team that hardly moves": ({"governor.kind": "certified", "control.alpha_r": 1e-7}, "control.alpha_r: is 1e-07,"),
    "the same, of a rollout": ({"governor.kind": "rollout", "control.alpha_r": 1e-7}, "control.alpha_r: is 1e-07,"),
    "the certificate of the optimum": (
        {"governor.kind": "centralized", "governor.certificate": "predictive", "control.alpha_r": 1e-7},
        "control.alpha_r: is 1e-07, with which the team does not settle",
    ),
    "beams that see too late": (
        {"governor.kind": "certified", "sensors.beams.range_max": 0.2},
        "governor.sight_rows: is true, but beams of 0.2 m",
    ),
    "wheels that no robot has": ({"robot": "omni", "sensors.odometry.fuse": True}, "sensors.odometry.fuse: is true,"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_run_is_refused_for_is_told(case, tmp_path, capsys):
    keys, says = REFUSED[case]
    scenario = pbrg.load("paper/experiment_near", keys, duration=0.1)
    with pytest.raises(pbrg.InputError) as of_run:
        pbrg.run(scenario)
    with pytest.raises(pbrg.InputError) as of_validate:
        pbrg.validate(scenario)
    assert str(of_validate.value) == str(of_run.value) and str(of_run.value).startswith(says)
    file = tmp_path / "given.yaml"
    file.write_text(scenario.yaml)
    assert main(["validate", str(file), "paper/experiment_near"]) == 2
    said = capsys.readouterr()
    assert said.err == f"error: {file}: {of_run.value}\n"
    assert said.out == "paper/experiment_near: ok, 5 robots, physics plant, 90 s\n"


def test_a_run_for_which_there_is_no_memory_here_is_not_put_together(monkeypatch):
    """Another machine may have it: it stays a warning."""
    scenario = pbrg.load("paper/experiment_near", {"governor.kind": "certified", "control.alpha_r": 1e-7})
    for module in ("pbrg_mj.api.scenario", "pbrg_mj.loop.resources"):
        monkeypatch.setattr(f"{module}.available_bytes", lambda: 1e8)
    (warning,) = pbrg.validate(scenario)
    assert "of memory" in warning
