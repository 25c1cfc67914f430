"""Gains that a scenario leaves out are those for its plant."""

import json

import numpy as np
import pytest

from pbrg_mj.scenario.load import load_scenario, load_text, parse_scenario
from pbrg_mj.world.scene.robot import load_robot_model
from tests.scenario_texts import THREE

IDEAL = THREE + "plant: ideal\nestimator: {source: given}\n"


def gains(text: str) -> tuple[float, float]:
    scenario = parse_scenario(text)
    return scenario.control.alpha_r, scenario.governor.alpha


def test_the_papers_experiment_in_physics_and_its_simulation_in_the_ideal_plant():
    names = ("experiment_near", "simulation_near")
    papers = [load_scenario(f"paper/{name}").scenario for name in names]
    assert [gains(THREE), gains(IDEAL)] == [(one.control.alpha_r, one.governor.alpha) for one in papers]


def test_a_gain_that_is_given_counts_and_the_other_is_still_the_plants():
    assert gains(IDEAL + "control: {alpha_r: 3}\n") == (3.0, 2.0)
    assert gains(IDEAL + "governor: {alpha: 4}\n") == (1.0, 4.0)
    assert gains(THREE + "control: {alpha_r: 3}\n") == (3.0, 7.0)


def test_another_plant_by_override_brings_its_gains():
    loaded = load_text(IDEAL, "three", ["plant=physics", "estimator.source=beams"], file="x.yaml")
    assert loaded.scenario.control.alpha_r == 2.5


def test_a_scenario_written_out_keeps_its_gains():
    for text in (THREE, IDEAL):
        scenario = parse_scenario(text)
        again = type(scenario).model_validate(json.loads(scenario.model_dump_json(by_alias=True)))
        assert (again.control, again.governor) == (scenario.control, scenario.governor)


@pytest.mark.parametrize(("alpha_r", "converged"), [(1.0, False), (2.5, True)])
def test_in_physics_the_default_holds_a_robot_within_the_tolerance(alpha_r, converged):
    """Static friction stops it short of m by its breakaway speed over alpha_r."""
    robot = load_robot_model()
    short = robot.top_speed * robot.static_torque / robot.stall_torque / alpha_r
    assert bool(np.less(short, parse_scenario(THREE).outcome.tolerance)) == converged
