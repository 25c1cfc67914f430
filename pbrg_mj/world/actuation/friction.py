"""Friction of gears, bearings and rolling, in the wheels' LuGre elements, and how it changes between working areas.

Rolling resistance of coefficient c turns a wheel of load N and radius r with c N r against its motion, and holds it
with as much at rest. It is added to the LuGre Coulomb and static torques because bristles hold without creeping:
MuJoCo's own rolling friction of contacts is a soft constraint, which lets a robot creep by up to 1e-3 m/s below
breakaway (docs/physics.md has the measurement).
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np

from pbrg_mj.scenario.robots import RobotName
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.floor import floor_of
from pbrg_mj.world.scene.robot import BIAS_FRICTION, WHEELS, RobotModel, load_arena, load_robot
from pbrg_mj.world.scene.variation import friction_scales

_SETTLED = 1.0  # [s] after which the robot stands still on its contacts


def friction_torques(robot: RobotModel, scale: float, rolling_resistance: np.ndarray) -> np.ndarray:
    """Return Coulomb and static torque (..., 2) [N m] of wheels on floors of `rolling_resistance` (...,) [-]."""
    gear = scale * np.array([robot.coulomb_torque, robot.static_torque])
    if not np.any(rolling_resistance):
        return np.broadcast_to(gear, (*np.shape(rolling_resistance), 2))
    return gear + (rolling_resistance * wheel_load(robot.name) * robot.wheel_radius)[..., None]


def set_friction(child: mujoco.MjSpec, scenario: Scenario, robot: RobotModel, j: int) -> None:
    """Give robot j's wheels its own friction and the bare floor's; no element where there is none."""
    torques = friction_torques(robot, float(friction_scales(scenario)[j]), floor_of(scenario.world).rolling_resistance)
    for side in robot.motors:
        element = child.actuator(f"friction_{side}")
        if torques.any():
            element.biasprm = _with_values(element.biasprm, BIAS_FRICTION, torques[0])
        else:
            child.delete(element)


def set_tyre_contacts(child: mujoco.MjSpec, floor: mujoco.MjsGeom) -> None:
    """Give a robot's tyres the floor's contact parameters and a higher priority, so that each can differ by place."""
    for side in WHEELS:
        tyre = child.geom(f"tyre_{side}")
        tyre.priority = floor.priority + 1
        tyre.friction, tyre.solref, tyre.solimp = floor.friction, floor.solref, floor.solimp


@cache
def wheel_load(name: RobotName = "generic") -> float:
    """Return the force [N] between one wheel and a level floor while the robot stands; the casters bear the rest."""
    arena = load_arena()
    arena.attach(load_robot(name), prefix="robot/", frame=arena.worldbody.add_frame())
    model = arena.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(_SETTLED / model.opt.timestep))
    tyre, force = model.geom("robot/tyre_left").id, np.zeros(6)
    contact = int(np.flatnonzero((data.contact.geom == tyre).any(axis=1))[0])
    mujoco.mj_contactForce(model, data, contact, force)
    return float(force[0])


class WheelFriction:
    """Looks up what lies under each wheel and gives its tyre and its LuGre element the friction of that area."""

    def __init__(self, scenario: Scenario, robot: RobotModel, model: mujoco.MjModel):
        """Find the wheels of a model that `add_patches` and `set_tyre_contacts` prepared."""
        names = [f"robot{j}/{{}}_{side}" for j in range(scenario.robots) for side in WHEELS]
        self._model = model
        self._wheel = np.array([model.body(name.format("wheel")).id for name in names])
        self._tyre = np.array([model.geom(name.format("tyre")).id for name in names])
        self._floor = floor_of(scenario.world)
        self._torques = np.array(
            [friction_torques(robot, scale, self._floor.rolling_resistance) for scale in friction_scales(scenario)]
        )  # (n, areas, 2)
        self._robot = np.repeat(np.arange(scenario.robots), len(WHEELS))
        elements = [model.actuator(name.format("friction")).id for name in names] if self._torques.any() else []
        self._element = np.array(elements, dtype=int)

    def update(self, data: mujoco.MjData) -> None:
        """Let every wheel feel the area below its centre from the next collision check on."""
        area = self._floor.area(data.xpos[self._wheel, :2])
        self._model.geom_friction[self._tyre, 0] = self._floor.friction[area]
        if len(self._element):
            self._model.actuator_biasprm[self._element, BIAS_FRICTION] = self._torques[self._robot, area]


def _with_values(numbers: np.ndarray, place: slice, values: np.ndarray) -> np.ndarray:
    changed = np.array(numbers)
    changed[place] = values
    return changed
