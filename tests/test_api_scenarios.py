"""Scenarios through the Python API: files, names, data, overrides."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.scenario.load import load_scenario, parse_scenario
from pbrg_mj.scenario.parse.document import read_document


def test_overrides_are_those_of_the_command_line():
    data = {
        "operator.reference": [2.0, 1.8],
        "governor.kind": "none",
        "governor.step": None,
        "estimator.memory": 1e-05,
        "team.start.0": np.array([-2.0, 0.25]),
        "governor.rounds": np.int64(7),
        "log.timings": False,
        "description": 'two "quotes": and é\u2028 - # no comment',
    }
    texts = [
        "operator.reference=[2.0, 1.8]",
        "governor.kind=none",
        "governor.step=null",
        "estimator.memory=0.00001",
        "team.start.0=[-2.0, 0.25]",
        "governor.rounds=7",
        "log.timings=false",
        'description="two \\"quotes\\": and é\\u2028 - # no comment"',
        "seed=7",
        "timing.duration=2.0",
    ]
    made = pbrg.load("paper/simulation_near", data, seed=7, duration=2.0)
    assert made.settings == load_scenario("paper/simulation_near", texts).scenario
    assert made.settings.description == data["description"]
    assert made.yaml == pbrg.load("paper/simulation_near", texts).yaml
    assert parse_scenario(made.yaml) == made.settings


def test_a_scenario_is_changed_without_changing_it():
    first = pbrg.load("paper/simulation_near")
    second = first.override({"governor.rounds": 3}, seed=9, duration=1.0)
    assert (first.settings.governor.rounds, second.settings.governor.rounds) == (10, 3)
    assert (second.settings.seed, second.settings.timing.duration, second.name) == (9, 1.0, first.name)
    assert second == pbrg.load("paper/simulation_near", {"governor.rounds": 3}, seed=9, duration=1.0)
    assert repr(second) == "<Scenario paper/simulation_near: 5 robots, ideal plant, 1 s>"


def test_data_make_the_scenario_that_their_yaml_makes(tmp_path):
    data = read_document(pbrg.template(), "x").data
    (tmp_path / "mine.yaml").write_text(pbrg.template())
    assert pbrg.load(data).settings == pbrg.load(tmp_path / "mine.yaml").settings
    assert pbrg.load(data, {"seed": 3}).settings.seed == 3


def test_yaml_is_the_files_own_text():
    made = pbrg.load("paper/experiment_near")
    assert made.yaml == load_scenario("paper/experiment_near").yaml_text
    assert "# Section 5.2" in made.yaml


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("paper/simulation_nea",), "did you mean paper/simulation_near?"),
        (("paper/simulation_near", {"governor.runds": 3}), "governor.runds: is unknown; did you mean `rounds`?"),
        (("paper/simulation_near", {"governor.rounds": "3"}), "governor.rounds: is '3'; allowed: a whole number"),
        (("paper/simulation_near", {"operator.reference": [float("nan"), 1.0]}), "operator.reference.0: is 'NaN'"),
        (("paper/simulation_near", {"operator.reference": {1.0, 2.0}}), "is no value of a scenario"),
        (("paper/simulation_near", ["governor.rounds"]), "allowed: path.to.key=value"),
        (({"seed": 3},), "<scenario>:1: team: is missing"),
    ],
)
def test_what_is_wrong_is_one_line(arguments, says):
    with pytest.raises(pbrg.InputError) as error:
        pbrg.load(*arguments)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_validate_gives_the_commands_warnings(tmp_path, capsys):
    (tmp_path / "late.yaml").write_text(pbrg.load("network/delayed_plain").yaml)
    warnings = pbrg.validate(tmp_path / "late.yaml")
    assert len(warnings) == 1 and "may be too late" in warnings[0]
    assert main(["validate", str(tmp_path / "late.yaml")]) == 0
    assert capsys.readouterr().err == f"warning: {tmp_path / 'late.yaml'}: {warnings[0]}\n"
    assert pbrg.validate("paper/experiment_near") == []


def test_the_bundled_ones_are_listed_sorted():
    listed = pbrg.list_scenarios()
    assert [one.name for one in listed] == sorted(one.name for one in listed)
    assert {one.name: one.robots for one in listed}["scale/twenty_robots"] == 20
