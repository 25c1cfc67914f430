"""Floors that differ from place to place, and the friction of motors."""

import mujoco
import numpy as np
import pytest

from pbrg_mj.scenario.schema import World
from pbrg_mj.world.actuation.friction import friction_torques, wheel_load
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.floor import floor_of
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario

ROBOT = load_robot_model()


def patch(start, end, **floor) -> dict:
    return {"from": start, "to": end, **floor}


def moved(world: MujocoPlant, command: tuple[float, float], seconds: float) -> float:
    """Hold the command; return the mean speed of the body over the last half [m/s]."""
    places = [world.truth().body_pose[0, :2]]
    for _ in range(round(seconds / 0.01)):
        world.advance(np.array([command]))
        places.append(world.truth().body_pose[0, :2])
    half = len(places) // 2
    return float(np.linalg.norm(places[-1] - places[half])) / (0.01 * (len(places) - 1 - half))


def test_edges_belong_to_a_patch_a_later_patch_covers_an_earlier_one_and_corners_come_in_any_order():
    floor = floor_of(World(patches=(patch((2, 1), (0, -1)), patch((1, 3), (4, 0)))))
    points = [[0, 0], [2, -1], [1, 0], [1.5, 0.5], [2, 1], [4, 3], [2.1, -0.1], [-1e-9, 0], [0.5, 1 + 1e-9], [5, 5]]
    np.testing.assert_array_equal(floor.area(np.array(points)), [1, 1, 2, 2, 2, 2, 0, 0, 0, 0])
    np.testing.assert_array_equal(floor.area(np.array([[[0.5, 0], [9, 9]]])), [[1, 0]])


def test_look_up_agrees_with_laying_one_patch_after_the_other():
    rng = np.random.default_rng(2)
    corners = rng.uniform(-1, 1, (6, 2, 2))
    floor = floor_of(World(patches=tuple(patch(tuple(a), tuple(b)) for a, b in corners)))
    for x, y in rng.uniform(-1.2, 1.2, (500, 2)):
        area = 0
        for k, ((ax, ay), (bx, by)) in enumerate(corners, start=1):
            if min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by):
                area = k
        assert floor.area(np.array([x, y])) == area


def test_a_floor_without_patches_is_bare_everywhere():
    floor = floor_of(World(floor_friction=0.4, rolling_resistance=0.02))
    np.testing.assert_array_equal(floor.area(np.zeros((3, 2))), [0, 0, 0])
    assert (floor.friction.tolist(), floor.rolling_resistance.tolist()) == ([0.4], [0.02])


def test_wheels_and_casters_share_the_weight_at_rest_and_at_speed():
    assert 2 * wheel_load() == pytest.approx(0.883 * ROBOT.mass * 9.81, rel=0.01)
    world = MujocoPlant(scenario())
    moved(world, (5.0, 5.0), 2.0)
    force, load = np.zeros(6), {}
    for k, contact in enumerate(world.data.contact):
        mujoco.mj_contactForce(world.model, world.data, k, force)
        load[world.model.geom(int(max(contact.geom))).name] = force[0]
    assert load["robot0/tyre_left"] == pytest.approx(wheel_load(), rel=1e-3)
    assert sum(load.values()) == pytest.approx(ROBOT.mass * 9.81, rel=1e-3)


def test_rolling_resistance_adds_its_torque_to_friction_at_rest_and_in_motion():
    torques = friction_torques(ROBOT, 0.5, np.array([0.0, 0.1]))
    gear = [0.5 * ROBOT.coulomb_torque, 0.5 * ROBOT.static_torque]
    rolling = 0.1 * wheel_load() * ROBOT.wheel_radius
    np.testing.assert_allclose(torques, [gear, np.add(gear, rolling)], rtol=1e-12)


@pytest.mark.parametrize("resistance", [0.03, 0.1])
@pytest.mark.parametrize("laid", ["floor", "patch"])
def test_a_resisting_floor_slows_a_rolling_robot_by_its_torque(resistance, laid):
    floor = {"rolling_resistance": resistance}
    world = MujocoPlant(scenario(world=floor if laid == "floor" else {"patches": [patch((-9, -9), (9, 9), **floor)]}))
    torque = ROBOT.coulomb_torque + resistance * wheel_load() * ROBOT.wheel_radius
    moved(world, (3.0, 3.0), 2.0)
    want = ROBOT.no_load_speed * (0.5 - torque / ROBOT.stall_torque)
    np.testing.assert_allclose(world.truth().wheel_speed[0], want, rtol=1e-3)


@pytest.mark.parametrize("resistance", [0.03, 0.1])
def test_a_resisting_floor_holds_without_creep_and_gives_way_at_its_torque(resistance):
    world = MujocoPlant(scenario(world={"rolling_resistance": resistance}))
    torque = ROBOT.static_torque + resistance * wheel_load() * ROBOT.wheel_radius
    voltage = ROBOT.voltage * torque / ROBOT.stall_torque
    assert moved(world, (0.9 * voltage, 0.9 * voltage), 4.0) < 1e-5
    assert moved(world, (1.05 * voltage, 1.05 * voltage), 4.0) > 1e-2


def test_the_same_floor_bare_or_as_a_patch_moves_the_robot_alike():
    """To rounding at most: a patch is felt through the tyres' contact parameters instead of the floor's."""
    floor = {"friction": 0.3, "rolling_resistance": 0.05}
    bare = MujocoPlant(scenario(world={"floor_friction": 0.3, "rolling_resistance": 0.05}))
    laid = MujocoPlant(scenario(world={"patches": [patch((-9, -9), (9, 9), **floor)]}))
    for world in (bare, laid):
        moved(world, (3.0, 2.0), 2.0)
    np.testing.assert_allclose(laid.truth().body_pose, bare.truth().body_pose, atol=1e-4)


def test_a_wheel_slips_on_a_slippery_patch_alone():
    """The right wheel stands on ice, the left one grips: stalled at 6 V it could push far harder than ice holds."""
    ice = patch((-1, -1), (3, 0), friction=0.02)
    world = MujocoPlant(scenario(world={"patches": [ice]}))
    for _ in range(10):
        world.advance(np.array([[6.0, 6.0]]))
    rim = ROBOT.wheel_radius * world.truth().wheel_speed[0]
    turn = world.data.qvel[5]
    over_ground = world.data.qvel[0] + np.array([-1, 1]) * turn * ROBOT.track / 2
    slip = rim - over_ground
    assert slip[1] > 0.5
    assert abs(slip[0]) < 0.15 * rim[0]


def test_patches_at_another_place_change_nothing():
    far = MujocoPlant(scenario(world={"patches": [patch((8, 8), (9, 9), friction=0.1, rolling_resistance=0.2)]}))
    none = MujocoPlant(scenario())
    for world in (far, none):
        moved(world, (2.0, 1.0), 1.0)
    np.testing.assert_allclose(far.truth().body_pose, none.truth().body_pose, atol=1e-6)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_drive_friction_scales_what_a_motor_needs_to_start_and_loses_in_motion(scale):
    voltage = scale * ROBOT.voltage * ROBOT.static_torque / ROBOT.stall_torque
    world = MujocoPlant(scenario(drive={"friction": scale}))
    for volts in np.linspace(0, 0.9 * voltage, 100):  # a step would make the bristles overshoot
        world.advance(np.full((1, 2), volts))
    assert moved(world, (0.9 * voltage, 0.9 * voltage), 3.0) < 1e-5
    assert moved(world, (1.05 * voltage, 1.05 * voltage), 3.0) > 1e-2
    moved(world, (3.0, 3.0), 2.0)
    want = ROBOT.no_load_speed * (0.5 - scale * ROBOT.coulomb_torque / ROBOT.stall_torque)
    np.testing.assert_allclose(world.truth().wheel_speed[0], want, rtol=1e-3)


def test_without_friction_there_is_no_friction_element_and_the_slightest_voltage_moves_the_robot():
    world = MujocoPlant(scenario(drive={"friction": 0.0}))
    assert world.model.na == 0
    moved(world, (0.01, 0.01), 2.0)
    np.testing.assert_allclose(world.truth().wheel_speed[0], 0.01 / ROBOT.motor_constant, rtol=1e-3)


def test_frictionless_motors_still_feel_a_resisting_patch():
    world = MujocoPlant(
        scenario(drive={"friction": 0.0}, world={"patches": [patch((-1, -1), (1, 1), rolling_resistance=0.1)]})
    )
    voltage = ROBOT.voltage * 0.1 * wheel_load() * ROBOT.wheel_radius / ROBOT.stall_torque
    assert moved(world, (0.9 * voltage, 0.9 * voltage), 3.0) < 1e-5
    assert moved(world, (1.1 * voltage, 1.1 * voltage), 3.0) > 5e-3
