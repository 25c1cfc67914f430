"""Working areas with a floor of their own, as each wheel meets them."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.floor import floor_of
from pbrg_mj.world.gear_friction import friction_torques
from pbrg_mj.world.model_index import WHEELS
from pbrg_mj.world.robot import BIAS_FRICTION, RobotModel

_THICKNESS = 2e-4  # of a patch's picture [m]; patches collide with nothing


class Patches:
    """Looks up what lies under each wheel and gives its tyre and its motor the friction of that area."""

    def __init__(self, scenario: Scenario, robot: RobotModel, model: mujoco.MjModel):
        """Find the wheels of a model that `add_patches` and `let_tyres_rule` prepared."""
        names = [f"robot{j}/{{}}_{side}" for j in range(scenario.robots) for side in WHEELS]
        self._model = model
        self._wheel = np.array([model.body(name.format("wheel")).id for name in names])
        self._tyre = np.array([model.geom(name.format("tyre")).id for name in names])
        self._motor = np.array([model.actuator(name.format("motor")).id for name in names])
        self._floor = floor_of(scenario.world)
        self._torques = friction_torques(robot, scenario.drive.friction, self._floor.rolling_resistance)

    def meet(self, data: mujoco.MjData) -> None:
        """Let every wheel feel the area below its centre from the next collision check on."""
        area = self._floor.area(data.xpos[self._wheel, :2])
        self._model.geom_friction[self._tyre, 0] = self._floor.friction[area]
        self._model.actuator_biasprm[self._motor, BIAS_FRICTION] = self._torques[area]


def add_patches(spec: mujoco.MjSpec, scenario: Scenario) -> None:
    """Draw the patches on the floor, a later one above earlier ones; brownish where wheels roll harder, else bluish."""
    floor = floor_of(scenario.world)
    for k, (low, high) in enumerate(zip(floor.low, floor.high, strict=True)):
        rougher = floor.rolling_resistance[k + 1] > floor.rolling_resistance[0]
        spec.worldbody.add_geom(
            name=f"patch{k}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[*(high - low) / 2, _THICKNESS * (k + 1) / 2],
            pos=[*(low + high) / 2, _THICKNESS * (k + 1) / 2],
            rgba=[0.72, 0.60, 0.45, 1] if rougher else [0.62, 0.74, 0.86, 1],
            contype=0,
            conaffinity=0,
        )


def let_tyres_rule(child: mujoco.MjSpec, floor: mujoco.MjsGeom) -> None:
    """Give a robot's tyres the floor's contact parameters and a higher priority, so that each can differ by place."""
    for side in WHEELS:
        tyre = child.geom(f"tyre_{side}")
        tyre.priority = floor.priority + 1
        tyre.friction, tyre.solref, tyre.solimp = floor.friction, floor.solref, floor.solimp
