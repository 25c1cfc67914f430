"""The hand point as the integrator that the pre-stabiliser believes in: driven by velocity alone, in physics."""

import numpy as np
import pytest

from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.actuation.friction import wheel_load
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario

ROBOT = load_robot_model()
TICK, SPEED, RADIUS = 0.01, 0.2, 0.3
TAU = ROBOT.driven_inertia * ROBOT.no_load_speed / ROBOT.stall_torque  # of a motor that drives [s]
SUNKEN = 0.0025  # share by which the rolling radius is short


def driven(kind: str, friction: float, length: float, circle: bool, stop: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return where the commanded velocity leads from rest (ticks, 2) and where the hand point is [m].

    For `stop` seconds after the path's end the command is 0.
    """
    plan = scenario(drive={"kind": kind, "friction": friction})
    world, drive = MujocoPlant(plan), drive_of(plan, ROBOT)
    goal, wanted, seen = np.zeros(2), [], []
    ticks = round(length / SPEED / TICK)
    for k in range(ticks + round(stop / TICK)):
        angle = (k + 0.5) * TICK * SPEED / RADIUS if circle else 0.0
        velocity = (SPEED if k < ticks else 0.0) * np.array([[np.cos(angle), np.sin(angle)]])
        world.advance(drive.command(velocity, world.truth().body_pose))
        goal = goal + TICK * velocity[0]
        wanted.append(goal)
        seen.append(world.truth().hand_world[0])
    return np.array(wanted), np.array(seen)


def farthest(off: np.ndarray) -> float:
    return float(np.linalg.norm(off, axis=1).max())


def off_path(q: np.ndarray, circle: bool) -> float:
    """The largest distance of hand points (N, 2) from the line y = 0 or from the circle about (0, RADIUS) [m]."""
    return float(np.abs(np.linalg.norm(q - [0, RADIUS], axis=1) - RADIUS if circle else q[:, 1]).max())


@pytest.mark.parametrize("friction", [0.0, 1.0])
@pytest.mark.parametrize(("circle", "length"), [(False, 1.0), (True, 2 * np.pi * RADIUS)])
def test_the_speed_loop_keeps_the_hand_point_within_one_percent_of_its_path(circle, length, friction):
    wanted, seen = driven("speed_loop", friction, length, circle)
    assert farthest(seen - wanted) < 0.01 * length
    assert off_path(seen, circle) < 0.01 * length


def test_open_loop_without_friction_lags_by_the_motors_time_constant_and_the_sunken_wheels():
    wanted, seen = driven("voltage", 0.0, 1.0, circle=False)
    assert farthest(seen - wanted) == pytest.approx(SPEED * TAU + SUNKEN * 1.0, rel=0.05)
    assert off_path(seen, circle=False) < 1e-6


@pytest.mark.parametrize(("circle", "length"), [(False, 1.0), (True, 2 * np.pi * RADIUS)])
def test_open_loop_without_friction_is_off_by_what_the_start_takes_and_by_little_else(circle, length):
    """From rest a motor of time constant tau falls tau v behind; what stays steady, on a circle too, loses no more."""
    wanted, seen = driven("voltage", 0.0, length, circle)
    wanted, seen = wanted[round(5 * TAU / TICK) :], seen[round(5 * TAU / TICK) :]
    lost = [SPEED * TAU, 0.0]
    assert (wanted - seen)[0, 0] == pytest.approx(SPEED * TAU, rel=0.03)
    assert farthest(seen - (wanted - lost)) < 0.01 * length
    assert farthest(seen - wanted) > 0.01 * length  # the start's loss alone is more than that


@pytest.mark.parametrize("kind", ["voltage", "speed_loop"])
@pytest.mark.parametrize(("circle", "length"), [(False, 1.0), (True, 2 * np.pi * RADIUS)])
def test_from_rest_to_rest_either_drive_ends_within_half_a_percent_of_its_path(kind, circle, length):
    wanted, seen = driven(kind, 0.0, length, circle, stop=2.0)
    assert farthest((seen - wanted)[-1:]) < 0.005 * length
    assert farthest(np.diff(seen[-2:], axis=0)) < 1e-7


def test_the_circle_of_the_open_loop_is_shifted_and_not_shrunk():
    q = driven("voltage", 0.0, 2 * np.pi * RADIUS, circle=True)[1][round(5 * TAU / TICK) :]
    x, y, power = np.linalg.lstsq(np.column_stack([2 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)[0]
    drawn, lagging = np.sqrt(power + x**2 + y**2), RADIUS / np.sqrt(1 + (SPEED * TAU / RADIUS) ** 2)
    assert drawn == pytest.approx((1 - SUNKEN) * RADIUS, abs=3e-4)
    assert drawn - (1 - SUNKEN) * lagging > 5e-4  # of a point whose velocity lags in the world
    assert (x, y - RADIUS) == pytest.approx((-SPEED * TAU, 0.0), abs=5e-3)


@pytest.mark.parametrize(("kind", "moves"), [("voltage", False), ("speed_loop", True)])
def test_only_the_speed_loop_moves_below_the_voltage_of_breakaway(kind, moves):
    slow = 0.8 * ROBOT.top_speed * ROBOT.static_torque / ROBOT.stall_torque
    plan = scenario(drive={"kind": kind})
    world, drive = MujocoPlant(plan), drive_of(plan, ROBOT)
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


def test_friction_compensation_leaves_what_breaks_away_beyond_coulomb_friction_as_static_error():
    """By the closed form 0.02 m/s of the 0.06 m/s below which the open loop moves nothing."""
    rest = come_to_rest(1.0, drive={"friction_compensation": True})
    beyond = (ROBOT.static_torque - ROBOT.coulomb_torque) / ROBOT.stall_torque
    assert 0.0 <= 1.0 - rest < ROBOT.top_speed * beyond


def come_to_rest(goal: float, **sections) -> float:
    """Drive the hand point to (goal, 0) by u = goal - q for 12 s; return where it is [m]."""
    plan = scenario(**sections)
    world, drive = MujocoPlant(plan), drive_of(plan, ROBOT)
    for _ in range(1200):
        truth = world.truth()
        world.advance(drive.command(np.array([[goal, 0.0]]) - truth.hand_world, truth.body_pose))
    return float(world.truth().hand_world[0, 0])
