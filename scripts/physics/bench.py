"""Robots to measure: one on stands, one on the floor."""

from __future__ import annotations

from typing import Any

import mujoco  # noqa: TID251
import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_arena, load_robot, load_robot_model

ROBOT = load_robot_model()
TICK = 0.01  # [s]
KINDS = ("voltage", "speed_loop")  # of drives
VOLT = ROBOT.voltage / ROBOT.stall_torque  # per torque at a standing wheel [V / N m]


def on_stands() -> mujoco.MjModel:
    """Return a robot whose wheels hang free."""
    arena, robot = load_arena(), load_robot()
    robot.delete(robot.joint("free"))
    arena.attach(robot, prefix="robot/", frame=arena.worldbody.add_frame(pos=[0, 0, 0.5]))
    return arena.compile()


def plan(**sections: Any) -> Scenario:
    """Return a scenario of one robot, its hand point at the origin, headed along +x."""
    data: dict[str, Any] = {
        "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
        "operator": {"reference": (0, 0)},
        "sensors": {"beams": {"robots": ()}},
    }
    return Scenario.model_validate(data | sections)


def on_floor(**sections: Any) -> MujocoPlant:
    """Return the world of `plan`."""
    return MujocoPlant(plan(**sections))


def hold(world: MujocoPlant, left: float, right: float, seconds: float) -> np.ndarray:
    """Hold a command; return the body poses (ticks, 3) after each tick."""
    poses = []
    for _ in range(round(seconds / TICK)):
        world.advance(np.array([[left, right]]))
        poses.append(world.truth().body_pose[0])
    return np.array(poses)
