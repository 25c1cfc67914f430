"""From a scenario to its plant."""

from __future__ import annotations

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.ideal import IdealPlant
from pbrg_mj.world.plant.interface import Plant
from pbrg_mj.world.plant.physics import MujocoPlant

PLANTS = {"physics": MujocoPlant, "ideal": IdealPlant}


def build_plant(scenario: Scenario) -> Plant:
    """Return the plant that `scenario.plant` names, at time 0."""
    return PLANTS[scenario.plant](scenario)
