"""The hand-written MJCF of robots and arena, and a robot's numbers, read from it so that they are stated once."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import mujoco

from pbrg_mj.scenario.bundled import data_dir
from pbrg_mj.scenario.robots import RobotName, reach, robot_file

WHEELS = ("left", "right")
DIRECTIONS = ("ahead", "aside")  # in which the motors of an omnidirectional base push


def load_arena() -> mujoco.MjSpec:
    """Return a fresh, editable copy of the arena."""
    return mujoco.MjSpec.from_file(str(data_dir("models") / "arena.xml"))


def load_robot(name: RobotName = "generic") -> mujoco.MjSpec:
    """Return a fresh, editable copy of a robot, without its keyframes: those are for viewers alone."""
    spec = mujoco.MjSpec.from_file(str(robot_file(name)))
    for key in spec.keys:
        spec.delete(key)
    return spec


# Places in MuJoCo's parameter arrays of actuators; the closed-form tests of the motor would see a shift.
BIAS_SPEED = 2  # of a motor
BIAS_FRICTION, _BIAS_STRIBECK = slice(3, 5), 5  # of a friction element: Coulomb, static
_DYN_BRISTLES = slice(5, 7)  # of a friction element: stiffness, damping


@dataclass(frozen=True)
class RobotModel:
    """A robot with two inputs: two wheels, or an omnidirectional base.

    Motor numbers are those at the wheel, after the gear; of the omnidirectional base, of both motors of a direction.
    """

    name: RobotName
    motors: tuple[str, str]  # of the two inputs: WHEELS or DIRECTIONS
    wheel_radius: float  # [m]
    track: float  # between the wheels' centres [m]; 0 of an omnidirectional base
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
    def omnidirectional(self) -> bool:
        """Whether the robot moves in any direction at any heading, which stays as it is."""
        return self.motors == DIRECTIONS

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
        """What each motor turns when the robot drives straight, at the wheel [kg m^2].

        Its wheel and half of the mass; the motors of an omnidirectional base move all of it.
        """
        mass = self.mass * self.wheel_radius**2
        return self.wheel_inertia + (mass if self.omnidirectional else mass / 2)

    @property
    def time_constant(self) -> float:
        """Of the speed behind the voltage when the robot drives straight [s]: J omega_0 / stall torque."""
        return self.driven_inertia * self.no_load_speed / self.stall_torque

    @property
    def loaded_speed(self) -> float:
        """Wheel speed at the nominal voltage against Coulomb friction [rad/s]: the most a wheel can be asked for."""
        return self.no_load_speed * (1 - self.coulomb_torque / self.stall_torque)

    @property
    def top_speed(self) -> float:
        """Speed of the unloaded, frictionless robot at the nominal voltage [m/s]."""
        return self.wheel_radius * self.no_load_speed


@cache
def load_robot_model(name: RobotName = "generic") -> RobotModel:
    """Return the numbers of a bundled robot's MJCF."""
    return read_robot_model(load_robot(name).compile(), name)


def read_robot_model(model: mujoco.MjModel, name: RobotName = "generic") -> RobotModel:
    """Read the numbers of one robot without a prefix. Both motors and wheels are alike."""
    omnidirectional = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "motor_left") < 0
    motors = DIRECTIONS if omnidirectional else WHEELS
    motor, friction = (model.actuator(f"{kind}_{motors[0]}") for kind in ("motor", "friction"))
    voltage, gain = float(motor.ctrlrange[1]), float(motor.gainprm[0])
    back_emf_damping = float(model.actuator_damping[motor.id] - motor.biasprm[BIAS_SPEED])  # K^2 / R [N m s/rad]
    coulomb, static = friction.biasprm[BIAS_FRICTION].tolist()
    stiffness, damping = friction.dynprm[_DYN_BRISTLES].tolist()
    wheel_radius, track, wheel_inertia = _wheels(model, motor.id, omnidirectional)
    skirt = model.geom("skirt")
    return RobotModel(
        name=name,
        motors=motors,
        wheel_radius=wheel_radius,
        track=track,
        hand_offset=float(model.site("hand").pos[0]),
        body_radius=reach(skirt.type[0] == mujoco.mjtGeom.mjGEOM_BOX, skirt.size.tolist(), skirt.pos.tolist()),
        mass=float(model.body("robot").subtreemass[0]),
        wheel_inertia=wheel_inertia,
        voltage=voltage,
        stall_torque=gain * voltage,
        no_load_speed=gain * voltage / back_emf_damping,
        coulomb_torque=coulomb,
        static_torque=static,
        stribeck_speed=float(friction.biasprm[_BIAS_STRIBECK]),
        bristle_stiffness=stiffness,
        bristle_damping=damping,
    )


def _wheels(model: mujoco.MjModel, motor: int, omnidirectional: bool) -> tuple[float, float, float]:
    """Return the wheels' radius, track [m] and inertia with gear and rotor [kg m^2].

    The wheels of an omnidirectional base are the gears of its motors, without inertia.
    """
    if omnidirectional:
        return 1.0 / float(model.actuator_gear[motor, 0]), 0.0, 0.0
    left, right = model.body("wheel_left"), model.body("wheel_right")
    inertia = float(left.inertia[1] + model.actuator_armature[motor])
    return float(model.geom("tyre_left").size[2]), float(left.pos[1] - right.pos[1]), inertia
