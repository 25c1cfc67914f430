"""The whole robot on the floor and against walls."""

import mujoco
import numpy as np
import pytest

from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()
BREAKAWAY = ROBOT.voltage * ROBOT.static_torque / ROBOT.stall_torque  # [V]


def drive(world: MujocoPlant, left: float, right: float, seconds: float) -> np.ndarray:
    """Hold voltages; return the body poses (ticks + 1, 3) of the first robot."""
    poses = [world.truth().body_pose[0]]
    command = np.tile([left, right], (len(world.truth().body_pose), 1))
    for _ in range(round(seconds / 0.01)):
        world.advance(command)
        poses.append(world.truth().body_pose[0])
    return np.array(poses)


def steady_wheel_speed(voltage: float) -> float:
    """Return the wheel speed that balances motor and gear friction, far above the Stribeck speed."""
    return ROBOT.no_load_speed * (voltage / ROBOT.voltage - ROBOT.coulomb_torque / ROBOT.stall_torque)


@pytest.mark.parametrize("voltage", [1.0, 3.0, 6.0])
def test_a_straight_line_at_the_speed_of_its_wheels(voltage):
    world = MujocoPlant(scenario())
    poses = drive(world, voltage, voltage, 2.0)
    speed = (poses[-1, 0] - poses[-11, 0]) / 0.1
    wheels = world.truth().wheel_speed[0]
    assert speed == pytest.approx(ROBOT.wheel_radius * wheels.mean(), rel=0.01)  # no slip
    assert wheels.mean() == pytest.approx(steady_wheel_speed(voltage), rel=1e-3)
    assert abs(poses[-1, 1]) < 1e-5
    assert abs(poses[-1, 2]) < 1e-4


def test_opposite_voltages_turn_on_the_spot():
    world = MujocoPlant(scenario())
    poses = drive(world, -2.0, 2.0, 2.0)
    turn = (np.unwrap(poses[:, 2])[-1] - np.unwrap(poses[:, 2])[-11]) / 0.1
    left, right = world.truth().wheel_speed[0]
    assert turn == pytest.approx(ROBOT.wheel_radius * (right - left) / ROBOT.track, rel=0.01)
    assert np.linalg.norm(poses[:, :2] - poses[0, :2], axis=1).max() < 1e-4


@pytest.mark.parametrize(
    ("left", "right"), [(0, 0), (0.3, 0.3), (0.5, 0.5), (0.7, 0.7), (0.9, 0.9), (0.7, -0.7), (0.9, -0.9), (0, 0.9)]
)
def test_a_robot_does_not_creep_below_breakaway(left, right):
    world = MujocoPlant(scenario())
    poses = drive(world, left * BREAKAWAY, right * BREAKAWAY, 4.0)
    assert np.linalg.norm(poses[-1, :2] - poses[200, :2]) / 2.0 < 1e-5
    assert abs(poses[-1, 2] - poses[200, 2]) / 2.0 < 1e-4


def test_a_coasting_robot_only_loses_energy_and_comes_to_rest():
    world = MujocoPlant(scenario())
    drive(world, 3.0, 3.0, 1.5)
    model, data = world.model, world.data
    momentum, kinetic = np.zeros(model.nv), []
    for _ in range(200):
        world.advance(np.zeros((1, 2)))
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        kinetic.append(data.qvel @ momentum / 2)
    # What the two wheels' bristles took, they may give back once; no more.
    stored = 2 * ROBOT.static_torque**2 / (2 * ROBOT.bristle_stiffness)
    assert (kinetic - np.minimum.accumulate(kinetic)).max() <= stored
    assert np.diff(kinetic[: np.argmax(np.array(kinetic) < stored)]).max() < 0
    assert kinetic[-1] < 1e-10 * kinetic[0]


def test_a_wall_is_touched_exactly_when_the_body_reaches_it_and_stops_the_robot():
    face = 0.5
    world = MujocoPlant(scenario(walls=(wall((face + 0.05, -1), (face + 0.05, 1)),)))
    gaps, touched = [], []
    for _ in range(200):
        world.advance(np.full((1, 2), 2.0))
        truth = world.truth()
        gaps.append(face - truth.body_pose[0, 0] - ROBOT.body_radius)
        touched.append(truth.wall_contact[0])
        assert truth.wall_margin[0] == pytest.approx(face - truth.hand_world[0, 0] - ROBOT.clearance, abs=1e-12)
    first = touched.index(True)
    assert min(gaps[:first]) > -1e-3
    assert gaps[first] < 0.005
    assert all(touched[-20:])
    assert abs(gaps[-1]) < 1e-3


def test_only_the_robot_that_touches_is_flagged_and_the_flag_falls_again():
    world = MujocoPlant(scenario(3, walls=(wall((1.3, -1), (1.3, 1)),)))
    apart = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, 2.0]])
    for _ in range(150):
        world.advance(apart)
    np.testing.assert_array_equal(world.truth().wall_contact, [False, False, True])
    for _ in range(50):
        world.advance(-apart)
    assert not world.truth().wall_contact.any()


def test_robots_that_meet_do_not_count_as_touching_a_wall():
    world = MujocoPlant(scenario(2, walls=(wall((3, -1), (3, 1)),)))
    for _ in range(100):
        world.advance(np.array([[3.0, 3.0], [-3.0, -3.0]]))
    first, second = world.truth().body_pose[:, 0]
    assert second - first == pytest.approx(2 * ROBOT.body_radius, abs=2e-3)
    assert not world.truth().wall_contact.any()
