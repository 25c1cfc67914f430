"""Where each robot's numbers stand in MuJoCo's arrays."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

WHEELS = ("left", "right")


@dataclass(frozen=True)
class ModelIndex:
    """Indices into MuJoCo's arrays: n robots, b of them with beams."""

    body: np.ndarray  # (n,) bodies at the axle's centre
    hand: np.ndarray  # (n,) sites
    free_joint: np.ndarray  # (n, 7) position and quaternion of the body, in qpos
    dofs: np.ndarray  # (n, 8) of the body and its wheels, in qvel
    motor: np.ndarray  # (n, 2) left, right in ctrl
    motor_state: np.ndarray  # (n, k) in act; none without friction
    wheel_speed: np.ndarray  # (n, 2) in qvel
    camera_position: np.ndarray  # (n, 2) x, y in sensordata
    camera_ahead: np.ndarray  # (n, 2) x, y of the body's x axis, in sensordata
    beams: np.ndarray  # (b, count) in sensordata
    wall_geom: np.ndarray  # (geoms,) bool
    robot_geom: np.ndarray  # (geoms, n) bool: geom belongs to the robot


def index_model(model: mujoco.MjModel, robots: int, carriers: tuple[int, ...], beams: int) -> ModelIndex:
    """Look the names of `compose` up. Raises KeyError when one is missing."""
    every = range(robots)

    def sensor(name: str) -> int:
        return model.sensor(name).adr[0]

    body = np.array([model.body(f"robot{j}/robot").id for j in every])
    root = np.array([model.body_rootid[k] for k in model.geom_bodyid])
    dof_root = model.body_rootid[model.dof_bodyid]
    motor = np.array([[model.actuator(f"robot{j}/motor_{side}").id for side in WHEELS] for j in every])
    free = np.array([model.joint(f"robot{j}/free").qposadr[0] for j in every])
    walls = model.body("walls").id
    position = np.array([sensor(f"robot{j}/position") for j in every])
    ahead = np.array([sensor(f"robot{j}/ahead") for j in every])
    return ModelIndex(
        body=body,
        hand=np.array([model.site(f"robot{j}/hand").id for j in every]),
        free_joint=free[:, None] + np.arange(7),
        dofs=np.array([np.flatnonzero(dof_root == k) for k in body]),
        motor=motor,
        motor_state=np.array([_states(model, motors) for motors in motor], dtype=int),
        wheel_speed=np.array([[model.joint(f"robot{j}/wheel_{s}").dofadr[0] for s in WHEELS] for j in every]),
        camera_position=position[:, None] + np.arange(2),
        camera_ahead=ahead[:, None] + np.arange(2),
        beams=np.array([[sensor(f"robot{j}/beam{k}") for k in range(beams)] for j in carriers], dtype=int).reshape(
            len(carriers), beams
        ),
        wall_geom=np.asarray(model.geom_bodyid == walls),
        robot_geom=root[:, None] == body,
    )


def _states(model: mujoco.MjModel, actuators: np.ndarray) -> list[int]:
    spans = zip(model.actuator_actadr[actuators], model.actuator_actnum[actuators], strict=True)
    return [place for first, count in spans for place in range(first, first + count)]
