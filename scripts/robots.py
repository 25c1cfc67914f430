"""Write docs/img/robots.png, and print the table of docs/robots.md: a ring of five of every bundled robot.

MUJOCO_GL=egl python scripts/robots.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import mujoco  # noqa: TID251
import numpy as np
from matplotlib.image import imsave

import pbrg_mj as pbrg
from pbrg_mj.scenario.robots import ROBOTS, RobotName, robot_file
from pbrg_mj.world.scene.robot import load_robot_model

FILE = Path(__file__).resolve().parents[1] / "docs" / "img" / "robots.png"
SCALE = {"turtlebot3_burger": 1.4, "epuck2": 0.4, "gritsbot": 0.6}  # of the paper's places
START = np.array([[-1.7, 0.4], [-1.4, -1.6], [-0.6, -1.5], [0.6, -1.8], [-0.5, -0.6]])
FORMATION = np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])


def picture(name: RobotName) -> np.ndarray:
    """Return a robot at home on its floor, as pixels."""
    model = mujoco.MjModel.from_xml_path(str(robot_file(name).with_name("scene.xml")))
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    camera.lookat[:] = [0.0, 0.0, 0.05]
    camera.distance, camera.azimuth, camera.elevation = 0.42, 140, -22
    with mujoco.Renderer(model, 360, 480) as renderer:
        renderer.update_scene(data, camera)
        return renderer.render().copy()


def ring(name: RobotName, scale: float, seconds: float) -> dict[str, Any]:
    """Return the paper's experiment with these robots and their own gains, its places scaled."""
    return {
        "robot": name,
        "timing": {"duration": seconds},
        "team": {
            "start": (scale * START).tolist(),
            "heading_deg": [20, 60, 45, 80, 30],
            "formation": (scale * FORMATION).tolist(),
            "leaders": [5],
        },
        "world": {"walls": [{"from": [5.1 * scale, -1.9 * scale], "to": [-1.9 * scale, 5.1 * scale]}]},
        "sensors": {"beams": {"robots": [5]}},
        "governor": {"initial": "start"},
        "operator": {"reference": [1.4 * scale, 1.18 * scale]},
    }


def row(name: RobotName, folder: str) -> str:
    """Return a line of the table: the robot's numbers, and where the team is after 120 s."""
    robot, scale = load_robot_model(name), SCALE.get(name, 1.0)
    scenario = pbrg.load(ring(name, scale, 120.0))
    figures = pbrg.run(scenario, log=f"{folder}/{name}.mcap").metrics
    control = scenario.settings.control
    cells = [
        f"`{name}`",
        f"{robot.mass:.2f}",
        f"{robot.body_radius:.3f}",
        f"{robot.hand_offset:.3f}",
        f"{robot.loaded_speed * robot.wheel_radius:.2f}",
        f"{1000 * robot.time_constant:.0f}",
        f"{control.alpha_r:g}",
        f"{scale:g}",
        figures.outcome,
        f"{figures.terminal_gap_m:.3f}",
        f"{figures.wall_contacts}, {figures.robot_contacts}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the picture; print the table."""
    tiles = [picture(name) for name in ROBOTS]
    imsave(FILE, np.vstack([np.hstack(tiles[:3]), np.hstack(tiles[3:])]))
    with tempfile.TemporaryDirectory() as folder:
        for name in ROBOTS:
            print(row(name, folder))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
