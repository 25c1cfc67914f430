"""The models of models/ as MuJoCo's own viewer loads them."""

import mujoco
import numpy as np
import pytest

from pbrg_mj.scenario.bundled import data_dir
from pbrg_mj.world.plant.compose import compose
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario

ROBOT = load_robot_model()
OPTIONS = ("timestep", "integrator", "cone", "impratio")


def load(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a model and its data at the keyframe `home`."""
    model = mujoco.MjModel.from_xml_path(str(data_dir("models") / f"{name}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    return model, data


def test_the_robot_alone_has_the_options_that_it_needs():
    robot = load("robot")[0].opt
    arena = mujoco.MjSpec.from_file(str(data_dir("models") / "arena.xml")).compile().opt
    composed = compose(scenario(2), ROBOT).compile().opt
    for name in OPTIONS:
        assert getattr(robot, name) == getattr(arena, name) == getattr(composed, name)


def test_without_a_floor_its_wheels_turn_by_the_closed_form():
    model, data = load("robot")
    data.ctrl[:] = 3.0
    mujoco.mj_step(model, data, nstep=500)
    want = ROBOT.no_load_speed * (0.5 - ROBOT.coulomb_torque / ROBOT.stall_torque)
    np.testing.assert_allclose([data.joint(f"wheel_{side}").qvel[0] for side in ("left", "right")], want, rtol=0.02)


def test_in_its_scene_it_stands_still_at_home_and_drives():
    model, data = load("scene")
    home = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=1000)
    np.testing.assert_allclose(data.qpos, home, atol=1e-5)
    data.ctrl[:] = 3.0
    mujoco.mj_step(model, data, nstep=1000)
    speed = ROBOT.wheel_radius * ROBOT.no_load_speed * (0.5 - ROBOT.coulomb_torque / ROBOT.stall_torque)
    assert data.joint("free").qvel[0] == pytest.approx(speed, rel=0.01)


def test_a_composed_world_has_no_keyframes():
    assert compose(scenario(2), ROBOT).compile().nkey == 0
