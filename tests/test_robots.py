"""The bundled robots: numbers of their data sheets, and runs with their own gains."""

from __future__ import annotations

from typing import get_args

import mujoco
import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.speed import turning_offset, wheel_facets
from pbrg_mj.scenario.bundled import data_dir
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.robots import GAINS, ROBOTS, RobotName, robot_file
from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.scenario_texts import THREE
from tests.worlds import scenario

# Mass [kg] and fastest speed [m/s] of data sheets: models/*/README.md names them.
SHEETS = {
    "generic": (0.4, 0.96),
    "turtlebot3_burger": (1.0, 0.22),
    "epuck2": (0.15, 0.154),
    "khepera4": (0.5, 1.0),
    "gritsbot": (0.25, 0.2),
    "omni": (0.4, 0.96),
}
TIP = 0.05  # [rad]


def test_names_are_those_of_the_folders():
    folders = {path.parent.name for path in data_dir("models").glob("*/robot.xml")}
    assert set(get_args(RobotName)) == set(ROBOTS) == set(GAINS) == set(SHEETS) == folders | {"generic"}
    for name in folders:
        assert {"scene.xml", "README.md", "LICENSE"} <= {one.name for one in robot_file(name).parent.iterdir()}


@pytest.mark.parametrize("name", ROBOTS)
def test_in_its_scene_it_stands_at_home_and_reaches_the_speed_of_its_data_sheet(name):
    robot, (mass, fastest) = load_robot_model(name), SHEETS[name]
    model = mujoco.MjModel.from_xml_path(str(robot_file(name).with_name("scene.xml")))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    home = data.qpos.copy()
    mujoco.mj_step(model, data, nstep=500)
    np.testing.assert_allclose(data.qpos, home, atol=1e-4)
    assert model.body("robot").subtreemass[0] == pytest.approx(mass, rel=0.01)
    driving = [model.actuator(f"motor_{side}").id for side in robot.motors][: 1 if robot.omnidirectional else 2]
    data.ctrl[driving] = robot.voltage
    mujoco.mj_step(model, data, nstep=1000)
    assert data.joint("free").qvel[0] == pytest.approx(fastest, rel=0.05)
    assert np.abs(data.qpos[4:6]).max() < TIP
    assert 0.005 < robot.time_constant < 0.25


@pytest.mark.parametrize("name", ROBOTS)
def test_default_gains_leave_the_error_of_friction_where_the_generic_robot_has_it(name):
    robot, (alpha_r, alpha) = load_robot_model(name), GAINS[name]
    breakaway = robot.top_speed * robot.static_torque / robot.stall_torque
    assert breakaway / alpha_r == pytest.approx(0.06 / 2.5, rel=0.05)
    assert alpha / alpha_r == pytest.approx(7.0 / 2.5, rel=0.03)
    assert parse_scenario(THREE + f"robot: {name}\n").control.alpha_r == alpha_r
    assert parse_scenario(THREE + f"robot: {name}\ncontrol: {{alpha_r: 0.3}}\n").control.alpha_r == 0.3


@pytest.mark.parametrize("kind", ["voltage", "speed_loop"])
@pytest.mark.parametrize("name", ROBOTS)
def test_the_drive_moves_the_hand_point_as_it_is_told(name, kind):
    """Without friction, at a steady velocity oblique to the heading: the speed in the world is the one asked for."""
    one = scenario(robot=name, drive={"kind": kind, "friction": 0.0}, team={"heading_deg": 40.0}, beams=())
    plant, robot = MujocoPlant(one), load_robot_model(name)
    drive, wanted = drive_of(one, robot), 0.4 * robot.top_speed * np.array([[np.cos(0.9), np.sin(0.9)]])
    places = []
    for _ in range(250):
        truth = plant.truth()
        places.append(truth.hand_world[0])
        plant.advance(drive.command(wanted, truth.body_pose))
    speed = (places[-1] - places[-51]) / 0.5
    np.testing.assert_allclose(speed, wanted[0], atol=0.012 * float(np.linalg.norm(wanted)))


def test_an_omnidirectional_base_keeps_its_heading():
    one = scenario(robot="omni", team={"heading_deg": 40.0}, beams=())
    plant, drive = MujocoPlant(one), drive_of(one, load_robot_model("omni"))
    for _ in range(200):
        plant.advance(drive.command(np.array([[0.1, -0.3]]), plant.observe().body_pose))
    assert plant.truth().body_pose[0, 2] == pytest.approx(np.deg2rad(40.0), abs=1e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_facets_hold_what_the_drive_does_unscaled(name):
    """A velocity on a facet's edge asks the faster motor for just its loaded speed, at any heading."""
    robot = load_robot_model(name)
    drive = drive_of(scenario(robot=name, drive={"kind": "speed_loop"}), robot)
    for angle in np.linspace(0.1, 6.2, 9):
        body = np.array([np.cos(angle), np.sin(angle)])
        velocity = body / (wheel_facets(robot) @ body).max()
        speeds = drive.command(1.001 * velocity[None], np.zeros((1, 3)))
        assert np.abs(speeds).max() == pytest.approx(robot.loaded_speed)
        assert np.abs(drive.command(0.99 * velocity[None], np.zeros((1, 3)))).max() < robot.loaded_speed
    assert np.isinf(turning_offset(robot)) == (name == "omni")


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("robot: epuck2\nsensors: {beams: {height: 0.03}}\n", "sensors.beams.height"),
        ("robot: omni\nworld: {rolling_resistance: 0.05}\n", "world.rolling_resistance"),
        ("robot: omni\nworld: {floor_friction: 0.5}\n", "world.floor_friction"),
        ("robot: omni\ndisturbances: {dead_motors: [{robot: 1, side: left, time: 1.0}]}\n", "disturbances.dead_motors"),
        ("robot: roomba\n", "robot"),
    ],
)
def test_keys_that_a_robot_has_no_use_for_are_refused(keys, message):
    with pytest.raises(InputError, match=message):
        parse_scenario(THREE + keys)


def test_the_room_at_the_start_is_that_of_the_chosen_robots():
    near = THREE.replace("[1, 0]", "[0.2, 0]").replace("[0, 90, 180]", "0")
    assert parse_scenario(near + "robot: khepera4\n").robots == 3
    with pytest.raises(InputError, match=r"allowed: 0\.27\d* m or more"):
        parse_scenario(near + "robot: turtlebot3_burger\n")
