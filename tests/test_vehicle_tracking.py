"""The hand point as the integrator that the pre-stabiliser believes in: driven by velocity alone, in physics."""

import numpy as np
import pytest

from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.gear_friction import wheel_load
from pbrg_mj.world.mujoco_world import MujocoWorld
from pbrg_mj.world.robot import load_robot_model
from tests.worlds import scenario

ROBOT = load_robot_model()
TICK, SPEED, RADIUS = 0.01, 0.2, 0.3


def farthest_off(kind: str, friction: float, length: float, circle: bool) -> float:
    """Return the largest distance of the hand point from where its commanded velocity leads [m]."""
    plan = scenario(drive={"kind": kind, "friction": friction})
    world, drive = MujocoWorld(plan), drive_of(plan, ROBOT)
    goal, off = np.zeros(2), []
    for k in range(round(length / SPEED / TICK)):
        angle = (k + 0.5) * TICK * SPEED / RADIUS if circle else 0.0
        velocity = SPEED * np.array([[np.cos(angle), np.sin(angle)]])
        world.advance(drive.command(velocity, world.truth().body_pose))
        goal = goal + TICK * velocity[0]
        off.append(np.linalg.norm(world.truth().hand_world[0] - goal))
    return float(max(off))


@pytest.mark.parametrize("friction", [0.0, 1.0])
@pytest.mark.parametrize(("circle", "length"), [(False, 1.0), (True, 2 * np.pi * RADIUS)])
def test_the_speed_loop_keeps_the_hand_point_within_one_percent_of_its_path(circle, length, friction):
    assert farthest_off("speed_loop", friction, length, circle) < 0.01 * length


def test_open_loop_without_friction_lags_by_the_motors_time_constant_and_the_sunken_wheels():
    tau = ROBOT.driven_inertia * ROBOT.no_load_speed / ROBOT.stall_torque
    sunken = 0.0025  # the rolling radius is a quarter of a percent short
    assert farthest_off("voltage", 0.0, 1.0, circle=False) == pytest.approx(SPEED * tau + sunken, rel=0.05)


@pytest.mark.parametrize(("kind", "moves"), [("voltage", False), ("speed_loop", True)])
def test_only_the_speed_loop_moves_below_the_voltage_of_breakaway(kind, moves):
    slow = 0.8 * ROBOT.top_speed * ROBOT.static_torque / ROBOT.stall_torque
    plan = scenario(drive={"kind": kind})
    world, drive = MujocoWorld(plan), drive_of(plan, ROBOT)
    before = world.truth().hand_world[0, 0]
    for _ in range(200):
        world.advance(drive.command(np.array([[slow, 0.0]]), world.truth().body_pose))
    moved = world.truth().hand_world[0, 0] - before
    assert moved == pytest.approx(2 * slow, rel=0.02) if moves else abs(moved) < 1e-3


@pytest.mark.parametrize(("goal", "resistance"), [(1.0, 0.0), (-1.0, 0.1)])
def test_a_robot_rests_short_of_its_goal_by_the_friction_of_the_area_it_stands_in(goal, resistance):
    """u = goal - q stops where its voltage turns no wheel any more: between Coulomb and static torque."""
    area = {"from": (-9, -9), "to": (-0.2, 9), "rolling_resistance": 0.1}
    rest = come_to_rest(goal, world={"patches": [area]})
    rolling = resistance * wheel_load() * ROBOT.wheel_radius
    torques = (ROBOT.coulomb_torque, ROBOT.static_torque)
    low, high = (ROBOT.top_speed * (torque + rolling) / ROBOT.stall_torque for torque in torques)
    assert 0.9 * low < abs(goal - rest) < 1.02 * high


@pytest.mark.parametrize(("kind", "friction"), [("voltage", 0.0), ("speed_loop", 1.0)])
def test_without_friction_or_with_the_speed_loop_it_reaches_its_goal(kind, friction):
    assert come_to_rest(1.0, drive={"kind": kind, "friction": friction}) == pytest.approx(1.0, abs=1e-4)


def come_to_rest(goal: float, **sections) -> float:
    """Drive the hand point to (goal, 0) by u = goal - q for 12 s; return where it is [m]."""
    plan = scenario(**sections)
    world, drive = MujocoWorld(plan), drive_of(plan, ROBOT)
    for _ in range(1200):
        truth = world.truth()
        world.advance(drive.command(np.array([[goal, 0.0]]) - truth.hand_world, truth.body_pose))
    return float(world.truth().hand_world[0, 0])
