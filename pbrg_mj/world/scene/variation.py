"""Robots that differ from their model: heavier, weaker, on larger wheels. Nothing that drives them knows of it."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Scenario, per_robot
from pbrg_mj.world.scene.robot import BIAS_SPEED, RobotModel


def vary(child: mujoco.MjSpec, scenario: Scenario, robot: RobotModel, j: int) -> None:
    """Scale robot j's mass, motor constant and wheel radius, in the editable model of one robot.

    The frame rises with the wheels, and the casters stay on the floor.
    """
    given, n = scenario.team.variation, scenario.robots
    mass, constant, radius = (per_robot(one, n)[j] for one in (given.mass, given.motor_constant, given.wheel_radius))
    if mass != 1.0:
        _scale_mass(child, mass)
    if constant != 1.0:
        for side in robot.motors:
            _scale_motor(child.actuator(f"motor_{side}"), constant)
    if radius != 1.0:
        _scale_wheels(child, robot, radius)


def friction_scales(scenario: Scenario) -> np.ndarray:
    """Return each robot's friction (n,) per that of the model, its variation and `drive.friction` together."""
    return scenario.drive.friction * np.array(per_robot(scenario.team.variation.friction, scenario.robots))


def _scale_mass(child: mujoco.MjSpec, scale: float) -> None:
    for body in child.bodies:
        if body.mass > 0.0:
            body.mass, body.inertia = scale * body.mass, scale * body.inertia


def _scale_motor(motor: mujoco.MjsActuator, scale: float) -> None:
    """Scale K in the torque K/R V - K^2/R w; the winding stays."""
    gain, bias = np.array(motor.gainprm), np.array(motor.biasprm)
    gain[0], bias[BIAS_SPEED] = scale * gain[0], scale**2 * bias[BIAS_SPEED]
    motor.gainprm, motor.biasprm, motor.damping = gain, bias, scale**2 * np.array(motor.damping)


def _scale_wheels(child: mujoco.MjSpec, robot: RobotModel, scale: float) -> None:
    if robot.omnidirectional:  # whose wheels are gears
        for side in robot.motors:
            for kind in ("motor", "friction"):
                element = child.actuator(f"{kind}_{side}")
                element.gear = np.array(element.gear) / scale
        return
    rise = (scale - 1.0) * robot.wheel_radius
    body = child.body("robot")
    body.pos = np.add(body.pos, [0.0, 0.0, rise])
    for geom in child.geoms:
        if geom.name.startswith("caster"):
            geom.pos = np.subtract(geom.pos, [0.0, 0.0, rise])
        elif geom.name.startswith("tyre"):
            geom.size = np.multiply(geom.size, [scale, 1.0, scale])
