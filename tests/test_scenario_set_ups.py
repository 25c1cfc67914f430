"""What `set_up=NAME` stands for, whatever the plant and wherever it is among the overrides."""

from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario


def recommended(name: str, *overrides: str) -> Scenario:
    return load_scenario(name, ["set_up=recommended", *overrides]).scenario


@pytest.mark.parametrize("name", bundled_scenarios())
def test_every_bundled_scenario_takes_the_recommended_set_up(name: str):
    """The ideal plant has neither beams nor motors; robots that have no beams are bound by what others see."""
    own, scenario = load_scenario(name).scenario, recommended(name)
    physics = scenario.plant == "physics"
    assert (scenario.governor.kind, scenario.governor.certificate, scenario.control.leak) == (
        "certified",
        "predictive",
        0,
    )
    assert scenario.drive.friction_compensation == physics
    source, scope = ("points", "own") if own.sensors.beams.robots == "all" else ("beams", "team")
    assert scenario.estimator.source == (source if physics else own.estimator.source)
    assert scenario.estimator.scope == (scope if physics else own.estimator.scope)
    assert scenario.world == own.world and scenario.team == own.team


def test_overrides_after_it_win_and_those_before_do_not():
    assert recommended("obstacles/box", "estimator.half_spaces_per_robot=5").estimator.half_spaces_per_robot == 5
    before = load_scenario("obstacles/box", ["control.leak=0.3", "set_up=recommended"]).scenario
    assert before.control.leak == 0.0


def test_it_goes_by_the_plant_and_the_drive_that_the_scenario_has_in_the_end():
    assert not recommended("obstacles/box", "drive.kind=speed_loop").drive.friction_compensation
    assert recommended("obstacles/box", "drive.kind=voltage").drive.friction_compensation


@pytest.mark.parametrize(
    ("beams", "unknown", "chosen"),
    [
        ("sweep_deg=360", "free", "free"),
        ("sweep_deg=300.0", "free", "closed"),
        ("sweep_deg=120", "strict", "strict"),
        ("preset=lidar", "free", "free"),
        ("robots=[1]", "free", "free"),
    ],
)
def test_space_that_no_beam_has_passed_is_not_entered_where_beams_leave_a_side_blind(
    beams: str, unknown: str, chosen: str
):
    scenario = load_scenario(
        "families/boxes", [f"estimator.unknown={unknown}", "set_up=recommended", f"sensors.beams.{beams}"]
    ).scenario
    assert scenario.estimator.unknown == chosen


def test_free_space_that_is_asked_for_after_it_stays_free():
    scenario = recommended("families/boxes", "sensors.beams.sweep_deg=90", "estimator.unknown=free")
    assert scenario.estimator.unknown == "free"


@pytest.mark.slow
@pytest.mark.parametrize("reference", [(655578.6, 755126.9), (10.0, 17.0)])
def test_who_sees_nothing_is_kept_off_a_wall_whose_end_the_one_that_sees_has_passed(reference: tuple[float, float]):
    """Oblique references draw the team along the wall of which only robot 5 knows, and past its end."""
    keys = {"set_up": "recommended", "operator.reference": list(reference)}
    run = pbrg.run(pbrg.load("paper/experiment_inadmissible", keys, duration=25.0, seed=81085))
    assert run.metrics.true_margin_min_m is not None and run.metrics.true_margin_min_m > 0.0
    assert run.metrics.wall_contacts == 0


def test_of_a_family_it_is_in_the_world_that_is_drawn():
    drawn = pbrg.load("families/boxes", {"set_up": "recommended"}, seed=3)
    assert drawn.yaml.count("points") == 1
    assert drawn.settings.drive.friction_compensation
    assert recommended("families/boxes", "seed=3", "estimator.unknown=closed").estimator.unknown == "closed"


@pytest.mark.parametrize("name", ["best", "[1]", "", "{recommended: true}"])
def test_a_name_that_there_is_not_is_refused(name: str):
    with pytest.raises(InputError, match=r"set_up=.*allowed: set_up=recommended"):
        load_scenario("families/boxes", [f"set_up={name}"])


def test_a_file_that_has_it_as_a_key_is_told_how_to_give_it(tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text(f"{pbrg.template()}\nset_up: recommended\n")
    with pytest.raises(InputError, match=r"mine.yaml:\d+: set_up: is an override.*--set set_up=recommended"):
        load_scenario(str(path))
