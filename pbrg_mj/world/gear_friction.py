"""Friction of gear, bearings and rolling, all of it in the motors' LuGre element.

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

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.floor import floor_of
from pbrg_mj.world.model_index import WHEELS
from pbrg_mj.world.models import load_spec
from pbrg_mj.world.robot import BIAS_FRICTION, DYN_BRISTLES, RobotModel

_SETTLED = 1.0  # [s] after which the robot stands still on its contacts


def friction_torques(robot: RobotModel, scale: float, rolling_resistance: np.ndarray) -> np.ndarray:
    """Return Coulomb and static torque (..., 2) [N m] of wheels on floors of `rolling_resistance` (...,) [-]."""
    gear = scale * np.array([robot.coulomb_torque, robot.static_torque])
    if not np.any(rolling_resistance):
        return np.broadcast_to(gear, (*np.shape(rolling_resistance), 2))
    return gear + (rolling_resistance * wheel_load() * robot.wheel_radius)[..., None]


def set_friction(child: mujoco.MjSpec, scenario: Scenario, robot: RobotModel) -> None:
    """Give a robot's motors the friction of `drive.friction` and the bare floor; no element where there is none."""
    resistance = floor_of(scenario.world).rolling_resistance
    coulomb_static = friction_torques(robot, scenario.drive.friction, resistance)[0]
    frictionless = scenario.drive.friction == 0 and not resistance.any()
    for side in WHEELS:
        motor = child.actuator(f"motor_{side}")
        motor.biasprm = _replaced(motor.biasprm, BIAS_FRICTION, coulomb_static)
        if frictionless:
            motor.dynprm = _replaced(motor.dynprm, DYN_BRISTLES, 0.0)
            motor.actdim = 0


@cache
def wheel_load() -> float:
    """Return the force [N] between one wheel and a level floor while the robot stands; the casters bear the rest."""
    arena = load_spec("arena")
    arena.attach(load_spec("robot"), prefix="robot/", frame=arena.worldbody.add_frame())
    model = arena.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(_SETTLED / model.opt.timestep))
    tyre, force = model.geom("robot/tyre_left").id, np.zeros(6)
    contact = int(np.flatnonzero((data.contact.geom == tyre).any(axis=1))[0])
    mujoco.mj_contactForce(model, data, contact, force)
    return float(force[0])


def _replaced(numbers: np.ndarray, place: slice, values: np.ndarray | float) -> np.ndarray:
    changed = np.array(numbers)
    changed[place] = values
    return changed
