"""From a scenario to its plant."""

from __future__ import annotations

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.ideal import IdealWorld
from pbrg_mj.world.interface import World
from pbrg_mj.world.mujoco_world import MujocoWorld

PLANTS = {"physics": MujocoWorld, "ideal": IdealWorld}


def build_world(scenario: Scenario) -> World:
    """Return the plant that `scenario.plant` names, at time 0."""
    return PLANTS[scenario.plant](scenario)
