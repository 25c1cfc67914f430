"""The set-up behind the table of the recommended governor in docs/scenarios.md."""

import pytest

from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.load import load_scenario
from scripts.measure_scenarios import set_up


@pytest.mark.parametrize("name", bundled_scenarios())
def test_motors_of_the_recommended_set_up_make_up_for_their_friction(name: str):
    scenario = load_scenario(name, set_up(name)).scenario
    assert scenario.drive.friction_compensation == (scenario.plant == "physics")
    assert (scenario.governor.kind, scenario.control.leak) == ("certified", 0.0)
