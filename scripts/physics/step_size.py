"""What the physics step changes: time constants, a driven wheel's angle, the closed loop; and where it diverges."""

from __future__ import annotations

import mujoco  # noqa: TID251
import numpy as np
from bench import ROBOT, on_floor, on_stands

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

STEPS = (0.002, 0.001, 0.0005)  # [s]
FINEST = 0.00025  # [s] what they are held against
BEYOND = (0.002, 0.0024, 0.0025, 0.003)  # [s] around the limit
CLOSED_LOOP = ("paper/experiment_near", "paper/experiment_inadmissible")
DURATION = 60.0  # of the closed loop [s]
EXACT_SENSORS = (
    "sensors.camera.position_std=0",
    "sensors.camera.heading_std_deg=0",
    "sensors.beams.noise_std=0",
    "sensors.beams.dropout=0",
)
INERTIA = {"air": ROBOT.wheel_inertia, "floor": ROBOT.driven_inertia}
TAU = {where: inertia * ROBOT.no_load_speed / ROBOT.stall_torque for where, inertia in INERTIA.items()}


def time_constants() -> dict[tuple[str, float], float]:
    """Return the motor's time constant [s] in the air and on the floor by step, fitted to a start with 2 V."""
    return {(where, step): _time_constant(where, step) for where in TAU for step in STEPS}


def _time_constant(where: str, step: float) -> float:
    model = _robot(where)
    model.opt.timestep = step
    data, seen = mujoco.MjData(model), []
    mujoco.mj_step(model, data, nstep=round(0.5 / step))
    data.ctrl[:] = 2.0
    left = model.joint(model.actuator(0).trnid[0]).dofadr[0]
    for _ in range(round(15 * TAU[where] / step)):
        mujoco.mj_step(model, data)
        seen.append(data.qvel[left])
    share = np.array(seen) / seen[-1]
    within = (share > 0.35) & (share < 0.95)
    slope, _ = np.polyfit(step * np.flatnonzero(within), np.log(1 - share[within]), 1)
    return float(-1 / slope)


def _robot(where: str) -> mujoco.MjModel:
    return on_stands() if where == "air" else on_floor().model


def driven_angle(step: float) -> float:
    """Return the angle [rad] that a wheel turns in 8 s on the floor under 1.65 V plus a sine of 1.5 V."""
    world = on_floor(timing={"physics_step": step})
    left = world.model.joint("robot0/wheel_left").qposadr[0]
    for tick in range(800):
        world.advance(np.full((1, 2), 1.65 + 1.5 * np.sin(2 * np.pi * 0.01 * tick / 2.5)))
    return float(world.data.qpos[left])


def driven_angles() -> dict[float, float]:
    """Return `driven_angle` by step, the finest included."""
    return {step: driven_angle(step) for step in (*STEPS, FINEST)}


def closed_loop() -> dict[tuple[str, float], dict[str, float]]:
    """Return how far hand points [m] are from those of the finest step: at most, and at the end; exact sensors."""
    found = {}
    for name in CLOSED_LOOP:
        finest = _hand_points(name, FINEST, *EXACT_SENSORS)
        for step in STEPS:
            found[name, step] = _apart(_hand_points(name, step, *EXACT_SENSORS), finest)
    return found


def seeds() -> dict[str, dict[str, float]]:
    """Return how far runs of seeds 1 and 2 are apart [m], sensors as they are, at the longest step."""
    return {name: _apart(*(_hand_points(name, STEPS[0], f"seed={seed}") for seed in (1, 2))) for name in CLOSED_LOOP}


def _hand_points(name: str, step: float, *changes: str) -> np.ndarray:
    changes = (f"timing.physics_step={step}", f"timing.duration={DURATION}", "reference.solver=none", *changes)
    records = Simulation.build(load_scenario(name, changes).scenario).records()
    return np.array([record.truth.hand_world for record in records])


def _apart(one: np.ndarray, other: np.ndarray) -> dict[str, float]:
    apart = np.linalg.norm(one - other, axis=2)
    return {"largest_m": float(apart.max()), "final_m": float(apart[-1].max())}


def reversals() -> dict[float, bool]:
    """Return by step whether 30 s of full voltages of either sign, drawn anew every 10 ms or so, stay finite."""
    return {step: all(_stays_finite(where, step) for where in TAU) for step in BEYOND}


def _stays_finite(where: str, step: float) -> bool:
    model = _robot(where)
    model.opt.timestep = step
    data, rng = mujoco.MjData(model), np.random.default_rng(7)
    for _ in range(3000):
        data.ctrl[:] = rng.choice([-ROBOT.voltage, ROBOT.voltage], 2)
        mujoco.mj_step(model, data, nstep=round(0.01 / step))
        if not np.abs(data.qvel).max() < 10 * ROBOT.no_load_speed:
            return False
    return True
