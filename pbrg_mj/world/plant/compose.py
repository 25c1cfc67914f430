"""Scenario -> MuJoCo model: the arena, n robots, obstacles and sensors.

Robots, their sensors and obstacles are named from 0 in the order of the scenario: `robot0/hand`, `robot0/beam12`,
`wall0`, `box0`.
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import colorsys

import mujoco
import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.actuation.friction import set_friction, set_tyre_contacts
from pbrg_mj.world.scene.contact_counters import add_contact_sensors
from pbrg_mj.world.scene.floor import add_patches
from pbrg_mj.world.scene.footprints import body_pose
from pbrg_mj.world.scene.obstacles import add_obstacles
from pbrg_mj.world.scene.robot import RobotModel, load_arena, load_robot
from pbrg_mj.world.scene.terrain import add_terrain
from pbrg_mj.world.scene.variation import vary
from pbrg_mj.world.sensors.beams import add_beams
from pbrg_mj.world.sensors.camera import add_camera_sensors
from pbrg_mj.world.sensors.sampling import Sampler
from pbrg_mj.world.sensors.surfaces import Surfaces

GOLDEN_RATIO = (np.sqrt(5) - 1) / 2


def start_pose(scenario: Scenario, robot: RobotModel) -> np.ndarray:
    """Return the body poses (n, 3) x, y [m], heading [rad] that put every hand point at its start."""
    q = np.asarray(scenario.team.start, dtype=float)
    heading = np.broadcast_to(np.deg2rad(scenario.team.heading_deg), len(q))
    return body_pose(q, heading, robot.hand_offset)


def compose(scenario: Scenario, robot: RobotModel) -> mujoco.MjSpec:
    """Return the editable model of the scenario's physics plant.

    Raises InputError where MuJoCo refuses it: sizes within their bounds may differ by more than its arithmetic takes.
    """
    spec = load_arena()
    spec.option.timestep = scenario.timing.physics_step
    spec.geom("floor").friction[0] = scenario.world.floor_friction
    add_obstacles(spec, scenario.world)
    add_patches(spec, scenario.world)
    add_terrain(spec, scenario.world)
    with_beams = set(scenario.beam_robots)
    for j, pose in enumerate(start_pose(scenario, robot)):
        child = _robot_spec(scenario, robot, j, beams=j in with_beams)
        set_friction(child, scenario, robot, j)
        if scenario.world.patches:
            set_tyre_contacts(child, spec.geom("floor"))
        _add_robot(spec, child, j, pose)
        add_contact_sensors(spec, j, scenario)
    try:
        spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError(f"is refused by MuJoCo: {reason}; allowed: sizes nearer to each other", key="world") from error
    return spec


def model_xml(spec: mujoco.MjSpec) -> str:
    """Return MJCF that compiles to the very same simulation, bit for bit."""
    # Compiled values would be printed with fewer digits than they have; the values as written are not rounded.
    saved = spec.copy()
    saved.compiler.savecompiled = 0
    return saved.to_xml()


def _add_robot(spec: mujoco.MjSpec, child: mujoco.MjSpec, j: int, pose: np.ndarray) -> None:
    frame = spec.worldbody.add_frame(pos=[pose[0], pose[1], 0.0], quat=_quat_about_z(float(pose[2])))
    spec.attach(child, prefix=f"robot{j}/", frame=frame)


def _robot_spec(scenario: Scenario, robot: RobotModel, j: int, beams: bool) -> mujoco.MjSpec:
    """Return one robot in its own colour, with its pose markers for the camera and, if it has any, its beams."""
    child = load_robot(scenario.robot)
    vary(child, scenario, robot, j)
    rgba = _colour(j)
    for name in ("tub", "bumper"):
        child.geom(name).rgba = rgba
    step, sensors = scenario.timing.physics_step, scenario.sensors
    child.option.timestep = step
    add_camera_sensors(child, Sampler(sensors.camera.rate_hz, step, sensors.camera.delay))
    if beams:
        height = sensors.beams.height if scenario.robot == "generic" else None
        add_beams(child, sensors.beams, Sampler(sensors.beams.rate_hz, step), height, Surfaces(scenario))
    return child


def _quat_about_z(angle: float) -> list[float]:
    return [np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)]


def _colour(j: int) -> list[float]:
    """Return a colour that differs from those of any other few robots: hues a golden ratio of the circle apart."""
    return [*colorsys.hsv_to_rgb((0.58 + j * GOLDEN_RATIO) % 1, 0.72, 0.80), 1.0]
