"""The hand-written MJCF of robot and arena, and the robot's numbers, read from it so that they are stated once."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import mujoco

from pbrg_mj.scenario.bundled import data_dir

WHEELS = ("left", "right")


def load_spec(name: Literal["robot", "arena"]) -> mujoco.MjSpec:
    """Return a fresh, editable copy of a model."""
    return mujoco.MjSpec.from_file(str(data_dir("models") / f"{name}.xml"))


# Places in MuJoCo's dcmotor parameter arrays; the closed-form tests of the motor would see a shift.
_GAIN_RESISTANCE, _GAIN_CONSTANT = 0, 1
BIAS_FRICTION, _BIAS_STRIBECK = slice(3, 5), 5  # Coulomb, static
DYN_BRISTLES = slice(5, 7)  # stiffness, damping


@dataclass(frozen=True)
class RobotModel:
    """A differential-drive robot. Motor numbers are those at the wheel, after the gear."""

    wheel_radius: float  # [m]
    track: float  # between the wheels' centres [m]
    hand_offset: float  # of the hand point ahead of the axle's centre [m]
    body_radius: float  # of the smallest disc around the axle's centre that holds the robot [m]
    mass: float  # [kg]
    wheel_inertia: float  # of a wheel with gear and rotor about its axle [kg m^2]
    voltage: float  # nominal and largest [V]
    stall_torque: float  # at the nominal voltage [N m]
    no_load_speed: float  # at the nominal voltage, without friction [rad/s]
    coulomb_torque: float  # LuGre friction while turning [N m]
    static_torque: float  # LuGre friction to break away [N m]
    stribeck_speed: float  # LuGre: speed over which static falls to Coulomb friction [rad/s]
    bristle_stiffness: float  # LuGre [N m/rad]
    bristle_damping: float  # LuGre [N m s/rad]

    @property
    def clearance(self) -> float:
        """Distance of the hand point from a wall that keeps the body off it at every heading [m]."""
        return self.body_radius + self.hand_offset

    @property
    def motor_constant(self) -> float:
        """Back-EMF per wheel speed, K_e [V s/rad]."""
        return self.voltage / self.no_load_speed

    @property
    def driven_inertia(self) -> float:
        """What each motor turns when the robot drives straight, at the wheel [kg m^2]: its wheel, half of the mass."""
        return self.wheel_inertia + self.mass * self.wheel_radius**2 / 2

    @property
    def loaded_speed(self) -> float:
        """Wheel speed at the nominal voltage against Coulomb friction [rad/s]: the most a wheel can be asked for."""
        return self.no_load_speed * (1 - self.coulomb_torque / self.stall_torque)

    @property
    def top_speed(self) -> float:
        """Speed of the unloaded, frictionless robot at the nominal voltage [m/s]."""
        return self.wheel_radius * self.no_load_speed


@cache
def load_robot_model() -> RobotModel:
    """Return the numbers of models/robot.xml."""
    return read_robot_model(load_spec("robot").compile())


def read_robot_model(model: mujoco.MjModel) -> RobotModel:
    """Read the numbers of one robot without a prefix. Both motors and wheels are alike."""
    motor = model.actuator("motor_left").id
    gain, bias, dyn = model.actuator_gainprm[motor], model.actuator_biasprm[motor], model.actuator_dynprm[motor]
    voltage = float(model.actuator_ctrlrange[motor, 1])
    resistance, constant = float(gain[_GAIN_RESISTANCE]), float(gain[_GAIN_CONSTANT])
    coulomb, static = bias[BIAS_FRICTION].tolist()
    stiffness, damping = dyn[DYN_BRISTLES].tolist()
    left, right = model.body("wheel_left"), model.body("wheel_right")
    return RobotModel(
        wheel_radius=float(model.geom("tyre_left").size[2]),
        track=float(left.pos[1] - right.pos[1]),
        hand_offset=float(model.site("hand").pos[0]),
        body_radius=float(model.geom("skirt").size[0]),
        mass=float(model.body("robot").subtreemass[0]),
        wheel_inertia=float(left.inertia[1] + model.dof_armature[model.joint("wheel_left").dofadr[0]]),
        voltage=voltage,
        stall_torque=constant * voltage / resistance,
        no_load_speed=voltage / constant,
        coulomb_torque=coulomb,
        static_torque=static,
        stribeck_speed=float(bias[_BIAS_STRIBECK]),
        bristle_stiffness=stiffness,
        bristle_damping=damping,
    )
