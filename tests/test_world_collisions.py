"""Robots that meet do not climb onto, or sink into, each other."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model

ROBOT = load_robot_model()


@pytest.mark.parametrize("turn", [0.0, 5.0, 90.0])
def test_a_collision_at_full_speed_leaves_bodies_apart_and_on_the_floor(turn):
    team = {
        "start": ((0.0, 0.0), (1.0, 0.02)),
        "heading_deg": (0.0, 180.0 - turn),
        "formation": ((0.0, 0.0), (1.0, 0.0)),
        "leaders": (1,),
    }
    plan = {"team": team, "operator": {"reference": (0.0, 0.0)}, "sensors": {"beams": {"robots": ()}}}
    world = MujocoPlant(Scenario.model_validate(plan))
    volts = np.array([[6.0, 6.0], [0.0, 0.0] if turn == 90.0 else [6.0, 6.0]])
    gaps, heights = [], []
    for _ in range(200):
        world.advance(volts)
        place = world.truth().body_pose[:, :2]
        gaps.append(np.linalg.norm(place[0] - place[1]) - 2 * ROBOT.body_radius)
        heights.append(world.data.xpos[world.model.body("robot0/robot").id, 2])
    assert min(gaps) < 0.005  # they met
    assert min(gaps) > -0.005
    assert max(heights) < ROBOT.wheel_radius + 0.01
