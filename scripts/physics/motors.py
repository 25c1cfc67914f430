"""Motors and their friction against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import mujoco  # noqa: TID251
import numpy as np
from bench import ROBOT, VOLT, hold, on_floor, on_stands

from pbrg_mj.world.actuation.friction import wheel_load

SHARES = (0.3, 0.5, 0.7, 0.9)  # of breakaway at which creep is measured


def speed_against_voltage() -> dict:
    """Steady wheel speed over voltage, on stands and on the floor, against stall (V / Vn - w / w0) = Coulomb."""
    model = on_stands()
    voltage = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0])
    want = ROBOT.no_load_speed * (voltage / ROBOT.voltage - ROBOT.coulomb_torque / ROBOT.stall_torque)
    free, floor = [], []
    for v in voltage:
        data = mujoco.MjData(model)
        data.ctrl[:] = v
        mujoco.mj_step(model, data, nstep=round(2.0 / model.opt.timestep))
        free.append(data.qvel[0])
        world = on_floor()
        hold(world, v, v, 2.0)
        floor.append(world.truth().wheel_speed[0].mean())
    worst = {name: float(np.abs(np.array(w) / want - 1).max()) for name, w in (("stands", free), ("floor", floor))}
    return {"voltage_V": voltage, "closed_form_rad_s": want, "stands_rad_s": free, "floor_rad_s": floor, "worst": worst}


def breakaway() -> list[dict]:
    """Torque at which a slow ramp of voltage (20 s up to the limit) turns the wheels, against the parameter."""
    found = []
    for resistance in (0.0, 0.03, 0.1):
        limit = ROBOT.static_torque + resistance * wheel_load() * ROBOT.wheel_radius
        world = on_floor(world={"rolling_resistance": resistance})
        voltage, rise = 0.0, limit * VOLT * 0.01 / 20
        while world.truth().wheel_speed.min() < 0.03 and voltage < 2 * limit * VOLT:
            voltage += rise
            hold(world, voltage, voltage, 0.01)
        found.append({"rolling_resistance": resistance, "limit_N_m": limit, "measured_N_m": voltage / VOLT})
    return found


def wheel_creep() -> float:
    """Return the fastest creep [rad/s] of a wheel on stands, from 1 s to 3 s after a voltage below breakaway."""
    model, worst = on_stands(), 0.0
    for share in SHARES:
        data = mujoco.MjData(model)
        data.ctrl[:] = share * ROBOT.static_torque * VOLT
        mujoco.mj_step(model, data, nstep=500)
        before = data.qpos.copy()
        mujoco.mj_step(model, data, nstep=1000)
        worst = max(worst, float(np.abs(data.qpos - before).max() / (1000 * model.opt.timestep)))
    return worst


def breakaway_of_steps() -> dict[str, float]:
    """Return the least share of breakaway at which a step of voltage turns a wheel: the bristles overshoot."""
    found = {"air": _least_share(lambda share: _turns_in_the_air(share * ROBOT.static_torque))}
    for scale in (0.5, 1.0, 2.0):
        found[f"floor, friction {scale:g}"] = _least_share(partial(_turns_on_the_floor, scale))
    return found


def _least_share(turns: Callable[[float], bool]) -> float:
    return next(share / 100 for share in range(50, 110) if turns(share / 100))


def _turns_in_the_air(torque: float) -> bool:
    model = on_stands()
    data = mujoco.MjData(model)
    data.ctrl[:] = torque * VOLT
    mujoco.mj_step(model, data, nstep=1000)
    return bool(data.qvel[0] > 0.1)


def _turns_on_the_floor(scale: float, share: float) -> bool:
    world, voltage = on_floor(drive={"friction": scale}), share * scale * ROBOT.static_torque * VOLT
    hold(world, 0.0, 0.0, 0.3)
    hold(world, voltage, voltage, 2.0)
    return bool(world.truth().wheel_speed.min() > 0.1)


def robot_creep() -> dict:
    """Creep of the robot [m/s] from 2 s to 4 s below breakaway; rolling resistance by bristles and by contacts."""
    creep = {"even_floor": max(_creep(on_floor(), ROBOT.static_torque * share) for share in SHARES)}
    for resistance in (0.03, 0.1):
        limit = ROBOT.static_torque + resistance * wheel_load() * ROBOT.wheel_radius
        bristles, contacts = on_floor(world={"rolling_resistance": resistance}), on_floor()
        _roll_in_contacts(contacts.model, resistance)
        creep[f"bristles_{resistance}"] = _creep(bristles, 0.9 * limit)
        creep[f"contacts_{resistance}"] = _creep(contacts, 0.9 * limit)
    return creep


def _creep(world, torque: float) -> float:
    poses = hold(world, torque * VOLT, torque * VOLT, 4.0)
    return float(np.linalg.norm(poses[-1, :2] - poses[200, :2])) / 2.0


def _roll_in_contacts(model: mujoco.MjModel, resistance: float) -> None:
    """MuJoCo's own rolling friction between tyres and floor, with the same torque."""
    for k in range(model.ngeom):
        if model.geom(k).name.split("/")[-1] in ("floor", "tyre_left", "tyre_right"):
            model.geom_condim[k] = 6
            model.geom_friction[k, 1:] = 1e-5, resistance * ROBOT.wheel_radius


def coasting() -> dict:
    """Kinetic energy of a robot after the voltage is cut from 3 V to 0 (motors shorted)."""
    world = on_floor()
    hold(world, 3.0, 3.0, 1.5)
    model, data = world.model, world.data
    momentum, kinetic = np.zeros(model.nv), []
    for _ in range(150):
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        kinetic.append(float(data.qvel @ momentum / 2))
        hold(world, 0.0, 0.0, 0.01)
    energy = np.array(kinetic)
    return {
        "kinetic_J": energy,
        "largest_rise_J": float((energy - np.minimum.accumulate(energy)).max()),
        "bristles_can_store_J": ROBOT.static_torque**2 / ROBOT.bristle_stiffness,  # two wheels, tau^2 / (2 sigma) each
    }
