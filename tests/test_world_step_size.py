"""Which steps the physics may take, and how little they change of time constants and trajectories."""

import mujoco
import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario, load_text, parse_scenario
from pbrg_mj.scenario.schema import LONGEST_PHYSICS_STEP
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_arena, load_robot, load_robot_model
from tests.scenario_texts import three
from tests.worlds import scenario

ROBOT = load_robot_model()
BACK_EMF = ROBOT.stall_torque / ROBOT.no_load_speed  # K^2 / R [N m s/rad]
STEPS = [0.002, 0.001, 0.0005]
EXACT_SENSORS = (
    "sensors.camera.position_std=0",
    "sensors.camera.heading_std_deg=0",
    "sensors.beams.noise_std=0",
    "sensors.beams.dropout=0",
)


def robot(step: float, on_floor: bool) -> mujoco.MjModel:
    """Return a robot on the floor, or one whose wheels hang free."""
    arena, child = load_arena(), load_robot()
    if not on_floor:
        child.delete(child.joint("free"))
    arena.attach(child, prefix="robot/", frame=arena.worldbody.add_frame(pos=[0, 0, 0 if on_floor else 0.5]))
    model = arena.compile()
    model.opt.timestep = step
    return model


def wheel_speeds(model: mujoco.MjModel, voltage: float, seconds: float) -> np.ndarray:
    """Return the left wheel's speed [rad/s] after each step of a constant voltage, from rest on settled contacts."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(0.5 / model.opt.timestep))
    data.ctrl[:] = voltage
    left, seen = model.joint("robot/wheel_left").dofadr[0], []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        seen.append(data.qvel[left])
    return np.array(seen)


def time_constant(speed: np.ndarray, step: float) -> float:
    """Return that of the exponential through a start [s], by least squares; bristles have settled at a third of it."""
    share = speed / speed[-1]
    within = (share > 0.35) & (share < 0.95)
    slope, _ = np.polyfit(step * np.flatnonzero(within), np.log(1 - share[within]), 1)
    return float(-1 / slope)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("voltage", [1.0, 2.0, 3.0])  # from 4 V on tyres slip at the start
@pytest.mark.parametrize("on_floor", [False, True])
def test_the_motors_time_constant_is_that_of_the_closed_form(on_floor, voltage, step):
    """J / (K^2 / R), with half of the robot's mass in J where it stands on its wheels."""
    inertia = ROBOT.driven_inertia if on_floor else ROBOT.wheel_inertia
    tau = inertia / BACK_EMF
    speed = wheel_speeds(robot(step, on_floor), voltage, 15 * tau)
    assert time_constant(speed, step) == pytest.approx(tau, rel=0.01)


def driven_angle(step: float) -> float:
    """Return the angle [rad] that a left wheel turns in 8 s on the floor under a voltage that oscillates."""
    world = MujocoPlant(scenario(timing={"physics_step": step}))
    left = world.model.joint("robot0/wheel_left").qposadr[0]
    for tick in range(800):
        world.advance(np.full((1, 2), 1.65 + 1.5 * np.sin(2 * np.pi * 0.01 * tick / 2.5)))
    return float(world.data.qpos[left])


def test_a_driven_wheel_turns_by_the_same_angle_at_the_longest_step():
    angle = driven_angle(0.00025)
    assert angle > 90
    assert driven_angle(LONGEST_PHYSICS_STEP) == pytest.approx(angle, abs=0.1)


@pytest.mark.parametrize("on_floor", [False, True])
def test_full_reversals_stay_finite_at_the_longest_step(on_floor):
    model = robot(LONGEST_PHYSICS_STEP, on_floor)
    data, rng, fastest = mujoco.MjData(model), np.random.default_rng(11), 0.0
    wheels = [model.joint(f"robot/wheel_{side}").dofadr[0] for side in ("left", "right")]
    for hold in rng.integers(1, 100, 300):
        data.ctrl[:] = rng.choice([-ROBOT.voltage, ROBOT.voltage], 2)
        mujoco.mj_step(model, data, nstep=hold)
        fastest = max(fastest, float(np.abs(data.qvel[wheels]).max()))
    assert np.isfinite(data.qpos).all()
    assert fastest < ROBOT.no_load_speed


def test_a_longer_step_is_refused_before_the_run():
    text = three(timing="{tick: 0.015, physics_step: 0.003, duration: 3}", reference="{period: 0.15}")
    with pytest.raises(InputError) as refused:
        load_text(text, "three", file="x.yaml")
    assert str(refused.value) == "x.yaml:10: timing.physics_step: is 0.003 s; allowed: at most 0.002 s"
    assert MujocoPlant(scenario(timing={"physics_step": LONGEST_PHYSICS_STEP})).steps_per_tick == 5


def test_a_log_with_a_longer_step_opens_and_is_not_run_again():
    """Earlier models took up to 5 ms: such a scenario is read, but no plant steps it."""
    old = parse_scenario(three(timing="{tick: 0.01, physics_step: 0.005, duration: 3}"))
    for build in (MujocoPlant, lambda plan: PlantBatch(plan, 2, 1)):
        with pytest.raises(InputError, match=r"timing.physics_step: is 0.005 s; allowed: at most 0.002 s"):
            build(old)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "bound"), [("near", 2.5e-3), ("inadmissible", 3.5e-3)])
def test_the_closed_loop_hardly_depends_on_the_step(name, bound):
    """With exact sensors: noise alone sets runs of two seeds centimetres apart."""
    runs = [closed_loop(f"paper/experiment_{name}", step) for step in (LONGEST_PHYSICS_STEP, 0.00025)]
    apart = np.linalg.norm(runs[0] - runs[1], axis=2)
    assert apart.max() < bound
    assert apart[-1].max() < 1e-4


def closed_loop(name: str, step: float) -> np.ndarray:
    """Return the hand points (ticks, n, 2) [m] of 60 s of a bundled scenario."""
    changes = (f"timing.physics_step={step}", "timing.duration=60", "reference.solver=none", *EXACT_SENSORS)
    records = Simulation.build(load_scenario(name, changes).scenario).records()
    return np.array([record.truth.hand_world for record in records])
