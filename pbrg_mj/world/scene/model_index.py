"""Where each robot's numbers stand in MuJoCo's arrays."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.contact_counters import counter_names
from pbrg_mj.world.scene.robot import RobotModel


@dataclass(frozen=True)
class ModelIndex:
    """Indices into MuJoCo's arrays: n robots, b of them with beams."""

    body: np.ndarray  # (n,) bodies at the axle's centre
    hand: np.ndarray  # (n,) sites
    free_joint: np.ndarray  # (n, 7) position and quaternion of the body, in qpos
    dofs: np.ndarray  # (n, 8) of the body and its wheels, in qvel; (n, 6) of an omnidirectional base
    motor: np.ndarray  # (n, 2) left, right, or ahead, aside in ctrl
    bristles: np.ndarray  # (n, 2) the same in act; (n, 0) without friction
    wheel_speed: np.ndarray  # (n, 2) the same in qvel, or of an omnidirectional base in actuator_velocity
    wheel_angle: np.ndarray  # (n, 2) in qpos; (n, 0) of an omnidirectional base
    camera_position: np.ndarray  # (n, 2) x, y in sensordata
    camera_ahead: np.ndarray  # (n, 2) x, y of the body's x axis, in sensordata
    beams: np.ndarray  # (b, rays of all beams) in sensordata
    contacts: np.ndarray  # (n, c) in sensordata: contacts with each kind of thing, see `contact_counters`
    earlier_contacts: np.ndarray  # (n, c, s) in history: the same at the s steps before


def index_model(model: mujoco.MjModel, scenario: Scenario, robot: RobotModel) -> ModelIndex:
    """Look the names of `compose` up. Raises KeyError when one is missing."""
    every, beam_robots, rays = range(scenario.robots), scenario.beam_robots, scenario.sensors.beams.all_rays
    counters = counter_names(scenario.world)

    def sensor(name: str) -> int:
        return model.sensor(name).adr[0]

    body = np.array([model.body(f"robot{j}/robot").id for j in every])
    dof_root = model.body_rootid[model.dof_bodyid]
    motor = np.array([[model.actuator(f"robot{j}/motor_{side}").id for side in robot.motors] for j in every])
    driven = model.actuator_trnid[motor, 0]  # (n, 2) joints of wheels, or sites
    free = np.array([model.joint(f"robot{j}/free").qposadr[0] for j in every])
    position = np.array([sensor(f"robot{j}/position") for j in every])
    ahead = np.array([sensor(f"robot{j}/ahead") for j in every])
    return ModelIndex(
        body=body,
        hand=np.array([model.site(f"robot{j}/hand").id for j in every]),
        free_joint=free[:, None] + np.arange(7),
        dofs=np.array([np.flatnonzero(dof_root == k) for k in body]),
        motor=model.actuator_ctrladr[motor],
        bristles=np.array([_states(model, joints) for joints in driven], dtype=int),
        wheel_speed=motor if robot.omnidirectional else model.jnt_dofadr[driven],
        wheel_angle=motor[:, :0] if robot.omnidirectional else model.jnt_qposadr[driven],
        camera_position=position[:, None] + np.arange(2),
        camera_ahead=ahead[:, None] + np.arange(2),
        beams=np.array([[sensor(f"robot{j}/beam{k}") for k in range(rays)] for j in beam_robots], dtype=int).reshape(
            len(beam_robots), rays
        ),
        contacts=np.array([[sensor(f"robot{j}/{name}") for name in counters] for j in every]),
        earlier_contacts=np.array(
            [[_history(model, model.sensor(f"robot{j}/{name}").id) for name in counters] for j in every]
        ),
    )


def motor_inputs(ctrl: np.ndarray, motor: np.ndarray) -> np.ndarray:
    """Return the motors' inputs (..., n, 2) as a view of MuJoCo's inputs (..., n k); `motor` is that of `ModelIndex`.

    Raises ValueError unless each robot has k inputs side by side, robot by robot, its two motors next to each other.
    """
    n, first = len(motor), int(motor[0, 0])
    of_robot = ctrl.reshape(*ctrl.shape[:-1], n, -1)
    each = np.arange(ctrl.shape[-1]).reshape(n, -1)
    if not np.array_equal(motor, each[:, first : first + 2]):
        raise ValueError("the model's inputs are not its motors, robot by robot")
    return of_robot[..., first : first + 2]


def _states(model: mujoco.MjModel, joints: np.ndarray) -> np.ndarray:
    """Return where the states of the actuators on these joints, or on this site, stand."""
    with_state = np.isin(model.actuator_trnid[:, 0], joints) & (model.actuator_actnum > 0)
    return model.actuator_actadr[with_state]


def _history(model: mujoco.MjModel, sensor: int) -> np.ndarray:
    """Return where the values of a scalar sensor's history stand: behind two of MuJoCo's own and the samples' times."""
    samples = model.sensor_history[sensor, 0]
    return model.sensor_historyadr[sensor] + 2 + samples + np.arange(samples)
