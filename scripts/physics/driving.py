"""The whole robot: tracking of the hand point, deadband of the drives, wheel slip, working areas."""

from __future__ import annotations

from collections import deque

import numpy as np
from bench import ROBOT, TICK, hold, on_floor, plan

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.actuation.friction import wheel_load
from pbrg_mj.world.plant.physics import MujocoPlant

SPEED, RADIUS, LENGTH = 0.2, 0.3, 1.0  # [m/s], [m], [m]
SHAPES = {"line": LENGTH, "circle": 2 * np.pi * RADIUS}  # lengths of the paths [m]
TAU = ROBOT.driven_inertia * ROBOT.no_load_speed / ROBOT.stall_torque  # time constant of a motor that drives [s]
STARTED = 5 * TAU  # [s]
STOPPED = 2.0  # after the path's end [s]
START_LOSS = np.array([SPEED * TAU, 0.0])  # [m] what motors of that time constant fall behind from rest, along +x


def tracking(shape: str, kind: str, friction: float) -> dict:
    """Drive the hand point by velocity alone, without position feedback, as the pre-stabiliser's integrator asks.

    Errors are the largest of the run: from where the hand point should be at that time (`worst`), from the path
    wherever on it (`across`), and from where it should be less what the motors lose at the start (`beyond_start`).
    `rest` is how far from the path's end it comes to rest when the velocity is set to 0 there.
    """
    scenario = plan(drive={"kind": kind, "friction": friction})
    world, drive = MujocoPlant(scenario), drive_of(scenario, ROBOT)
    length = SHAPES[shape]
    wanted, seen = [], []
    for k in range(round(length / SPEED / TICK)):
        middle = (k + 0.5) * TICK * SPEED
        angle = middle / RADIUS if shape == "circle" else 0.0
        velocity = SPEED * np.array([[np.cos(angle), np.sin(angle)]])
        world.advance(drive.command(velocity, world.truth().body_pose))
        wanted.append(TICK * velocity[0])
        seen.append(world.truth().hand_world[0])
    for _ in range(round(STOPPED / TICK)):
        world.advance(np.zeros((1, 2)))
    path, seen = np.cumsum(wanted, axis=0), np.array(seen)
    late = TICK * np.arange(1, len(path) + 1) > STARTED
    errors = {
        "worst": np.linalg.norm(seen - path, axis=1),
        "across": across(shape, seen),
        "beyond_start": np.linalg.norm(seen - path + START_LOSS, axis=1)[late],
        "rest": np.linalg.norm(world.truth().hand_world - path[-1], axis=1),
    }
    found = {"wanted_m": path, "seen_m": seen, "behind_m": (path - seen)[late][0]}
    for name, error in errors.items():
        found |= {f"{name}_m": float(error.max()), f"{name}_share": float(error.max()) / length}
    return found


def across(shape: str, q: np.ndarray) -> np.ndarray:
    """Return how far hand points (N, 2) are from the path [m]: the line y = 0, or the circle about (0, RADIUS)."""
    return np.abs(q[:, 1] if shape == "line" else np.linalg.norm(q - [0.0, RADIUS], axis=1) - RADIUS)


def drawn_radius() -> float:
    """Return the radius [m] of the circle that the open loop draws without friction, once started (least squares)."""
    q = tracking("circle", "voltage", 0.0)["seen_m"][round(STARTED / TICK) :]
    x, y, power = np.linalg.lstsq(np.column_stack([2 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(power + x**2 + y**2))


def deadband(kind: str) -> dict:
    """Speed of the hand point straight ahead over the wanted speed, the robot starting from rest."""
    wanted = np.array(
        [0.001, 0.002, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05, 0.055, 0.06, 0.065, 0.07, 0.08, 0.1, 0.15, 0.2]
    )
    drive, moved = drive_of(plan(drive={"kind": kind}), ROBOT), []
    for speed in wanted:
        world = on_floor(drive={"kind": kind})
        left, right = drive.command(np.array([[speed, 0.0]]), np.zeros((1, 3)))[0]
        poses = hold(world, left, right, 4.0)
        moved.append((poses[-1, 0] - poses[199, 0]) / 2.0)
    moved = np.array(moved)
    still = wanted[moved < 0.1 * wanted]
    return {"wanted_m_s": wanted, "moved_m_s": moved, "deadband_m_s": float(still.max(initial=0.0))}


def slip() -> list[dict]:
    """Accelerations at full voltage on slippery floors, mean of 0.5 s, against mu times wheel load over mass."""
    found = []
    for mu in (0.02, 0.05, 0.1, 0.2):
        world = on_floor(world={"patches": [{"from": (-9, -9), "to": (9, 9), "friction": mu}]})
        hold(world, ROBOT.voltage, ROBOT.voltage, 0.5)
        found.append(
            {
                "friction": mu,
                "acceleration_m_s2": float(world.data.qvel[0]) / 0.5,
                "closed_form_m_s2": 2 * mu * wheel_load() / ROBOT.mass,
                "rim_m_s": float(ROBOT.wheel_radius * world.truth().wheel_speed.mean()),
                "over_ground_m_s": float(world.data.qvel[0]),
            }
        )
    return found


def floors() -> dict[str, np.ndarray]:
    """Static errors (n,) [m] of one governed team on different floors, open-loop voltage."""
    patches, even = "floor/friction_patches", "world.patches=[]"
    return {
        "no friction in motors and floor": working_areas("floor/frictionless"),
        "even floor": working_areas(patches, even),
        "rolling resistance 0.05 everywhere": working_areas(patches, even, "world.rolling_resistance=0.05"),
        "patches of 0.1 and 0.05, else 0": working_areas(patches),
        "rolling resistance 0.1 everywhere": working_areas(patches, even, "world.rolling_resistance=0.1"),
    }


def working_areas(name: str, *changes: str) -> np.ndarray:
    """Run a bundled scenario; return how far each robot (n,) stays from its place in the formation at the end [m]."""
    scenario = load_scenario(name, [*changes, "reference.solver=none"]).scenario
    (record,) = deque(Simulation.build(scenario).records(), maxlen=1)
    target = np.array(scenario.team.formation) + np.array(scenario.operator.reference)
    return np.linalg.norm(record.truth.hand_world - target, axis=1)
