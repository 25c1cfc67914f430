"""Pushes, dead motors and kidnapped robots against closed forms."""

import numpy as np
import pytest

from pbrg_mj.world.actuation.disturbances import Disturbances
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()


def run(world: MujocoPlant, seconds: float, voltage=(0.0, 0.0)) -> None:
    command = np.tile(voltage, (len(world.truth().body_pose), 1)).astype(float)
    for _ in range(round(seconds / 0.01)):
        world.advance(command)


def settled(**sections) -> MujocoPlant:
    return MujocoPlant(scenario(drive={"friction": 0.0}, **sections))


@pytest.mark.parametrize("force", [(0.4, 0.0), (0.0, -0.4), (0.3, 0.2)])
def test_on_a_slippery_floor_the_impulse_is_the_change_of_momentum(force):
    """Casters keep a friction of their own: what is lost to it in 0.2 s is measured without a push."""
    world = settled(
        world={"floor_friction": 1e-5},
        disturbances={"pushes": [{"robot": 1, "time": 0.5, "duration": 0.2, "force": force}]},
    )
    run(world, 0.5)
    before = world.data.qvel[:2].copy()
    run(world, 0.2)
    gained = ROBOT.mass * (world.data.qvel[:2] - before)
    np.testing.assert_allclose(gained, np.multiply(force, 0.2), atol=0.01 * 0.2 * np.hypot(*force))
    after = world.data.qvel[:2].copy()
    run(world, 0.1)
    np.testing.assert_allclose(world.data.qvel[:2], after, atol=0.01 * np.hypot(*after))


def test_a_push_along_rolling_wheels_ends_at_the_speed_at_which_the_shorted_motors_hold_it():
    """Each motor holds with K^2 w / R at the wheel: F r = 2 (stall torque / no-load speed) w."""
    world = settled(disturbances={"pushes": [{"robot": 1, "time": 0.0, "duration": 3.0, "force": (0.5, 0.0)}]})
    run(world, 3.0)
    w = 0.5 * ROBOT.wheel_radius / (2 * ROBOT.stall_torque / ROBOT.no_load_speed)
    np.testing.assert_allclose(world.truth().wheel_speed[0], [w, w], rtol=0.02)


def test_pushes_act_in_their_steps_alone_and_add_up():
    pushes = [
        {"robot": 2, "time": 0.1, "duration": 0.2, "force": (1.0, 0.0)},
        {"robot": 2, "time": 0.2, "duration": 0.3, "force": (0.0, 2.0)},
    ]
    happen = Disturbances(scenario(2, disturbances={"pushes": pushes}))
    steps = {49: (0, 0), 50: (1, 0), 99: (1, 0), 100: (1, 2), 149: (1, 2), 150: (0, 2), 249: (0, 2), 250: (0, 0)}
    for step, force in steps.items():
        np.testing.assert_array_equal(happen.force(step), [(0, 0), force])


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_a_robot_with_a_dead_motor_turns_about_the_wheel_that_brakes(side, sign):
    world = MujocoPlant(scenario(disturbances={"dead_motors": [{"robot": 1, "side": side, "time": 0.0}]}))
    pivot = np.array([-ROBOT.hand_offset, sign * ROBOT.track / 2])
    turned = []
    for _ in range(200):
        world.advance(np.full((1, 2), 3.0))
        truth = world.truth()
        turned.append(truth.body_pose[0, 2])
        assert np.linalg.norm(truth.body_pose[0, :2] - pivot) == pytest.approx(ROBOT.track / 2, abs=5e-3)
    assert sign * np.unwrap(turned)[-1] > 2 * np.pi
    dead, alive = world.truth().wheel_speed[0][:: 1 if side == "left" else -1]
    assert abs(dead) < 0.02 * alive


def test_a_motor_comes_back_and_commands_are_left_as_they_are():
    dead = [{"robot": 1, "side": "left", "time": 0.1, "duration": 0.1}]
    happen, command = Disturbances(scenario(2, disturbances={"dead_motors": dead})), np.full((2, 2), 5.0)
    for step, left in {49: 5, 50: 0, 99: 0, 100: 5}.items():
        np.testing.assert_array_equal(happen.without_dead_motors(command, step), [(left, 5), (5, 5)])
    np.testing.assert_array_equal(command, 5.0)


KIDNAPPING = {"robot": 2, "time": 0.3, "duration": 0.4, "to": (3.0, 1.0), "heading_deg": 120.0}


def kidnapped(**changes) -> MujocoPlant:
    return MujocoPlant(
        scenario(
            2,
            beams={"count": 8},
            walls=(wall((0.3, 1.0), (0.6, 1.0)),),
            disturbances={"kidnappings": [KIDNAPPING | changes]},
            sensors={"camera": {"rate_hz": 30.0}},
        )
    )


def test_a_carried_robot_is_put_down_at_rest_in_place():
    world = kidnapped()
    run(world, 0.7, (5.0, 4.0))
    truth = world.truth()
    np.testing.assert_allclose(truth.hand_world[1], (3.0, 1.0), atol=1e-9)
    assert np.rad2deg(truth.body_pose[1, 2]) == pytest.approx(120.0, abs=1e-9)
    assert np.abs(world.data.qvel).reshape(2, 8)[1].max() == 0.0
    assert np.abs(world.data.act).reshape(2, 2)[1].max() == 0.0  # nor are its motors' bristles bent
    run(world, 1.0)
    np.testing.assert_allclose(world.truth().hand_world[1], (3.0, 1.0), atol=1e-3)
    run(world, 0.5, (5.0, 5.0))
    ahead = world.truth().hand_world[1] - (3.0, 1.0)
    assert np.rad2deg(np.arctan2(*ahead[::-1])) == pytest.approx(120.0, abs=1.0)
    assert np.linalg.norm(ahead) > 0.2


def test_the_speed_loops_do_not_wind_up_in_the_air():
    world = MujocoPlant(scenario(2, drive={"kind": "speed_loop"}, disturbances={"kidnappings": [KIDNAPPING]}))
    run(world, 0.7, (0.3, 0.3))  # rad/s, told in vain for 0.4 s; slow enough for the integral to go on
    run(world, 1.0)
    np.testing.assert_allclose(world.truth().hand_world[1], (3.0, 1.0), atol=1e-3)


def test_in_the_air_it_hovers_where_it_was_and_nobody_meets_it():
    world = kidnapped(time=0.2, duration=1.0)
    run(world, 0.2, (2.0, 2.0))
    lifted = world.truth().body_pose[1]
    for _ in range(99):
        np.testing.assert_allclose(world.truth().body_pose[1], lifted, atol=1e-9)
        np.testing.assert_array_equal(world.truth().wheel_speed[1], 0.0)
        world.advance(np.full((2, 2), 6.0))  # robot 1 drives through where robot 2 was
    assert world.truth().body_pose[0, 0] > lifted[0]
    world.advance(np.zeros((2, 2)))
    np.testing.assert_allclose(world.truth().hand_world[1], (3.0, 1.0), atol=1e-9)


def test_the_camera_keeps_the_last_frame_before_and_beams_miss_the_robot():
    world = kidnapped()
    seen, truth = [], []
    for _ in range(100):
        seen.append(world.observe())
        truth.append(world.truth().body_pose)
        world.advance(np.full((2, 2), 1.0))
    np.testing.assert_allclose(seen[29].ranges[0, 0], seen[0].ranges[0, 0], atol=0.05)
    for k in range(40, 70):  # frames 9 to 20 are taken in the air, scans 3 to 6
        assert seen[k].pose_frame in range(12, 21)
        np.testing.assert_array_equal(seen[k].body_pose[1], seen[29].body_pose[1])
        assert not 0 < seen[k].ranges[0, 0] < 4  # at most a spot far off on the floor
        np.testing.assert_array_equal(seen[k].ranges[1], -1.0)
        assert seen[k].body_pose[0, 0] > seen[29].body_pose[0, 0]
    np.testing.assert_allclose(seen[70].body_pose[1], truth[70][1], atol=1e-9)
    assert (seen[71].ranges[1] > 0).any() or (seen[80].ranges[1] > 0).any()


def test_a_late_camera_loses_the_robot_late():
    world = MujocoPlant(
        scenario(2, disturbances={"kidnappings": [KIDNAPPING]}, sensors={"camera": {"rate_hz": 100.0, "delay": 0.1}})
    )
    seen, truth = [], []
    for _ in range(100):
        seen.append(world.observe().body_pose[1])
        truth.append(world.truth().body_pose[1])
        world.advance(np.full((2, 2), 2.0))
    for k in range(10, 100):
        then = k - 10
        np.testing.assert_allclose(seen[k], truth[29 if 30 <= then < 70 else then], atol=1e-9)


def test_carried_at_the_start_and_twice_in_a_row():
    carries = [
        {"robot": 1, "time": 0.0, "duration": 0.1, "to": (1.0, 0.0)},
        {"robot": 1, "time": 0.1, "duration": 0.1, "to": (2.0, 0.0)},
    ]
    world = MujocoPlant(scenario(disturbances={"kidnappings": carries[::-1]}))
    places = []
    for _ in range(25):
        places.append((world.truth().hand_world[0, 0], world.observe().body_pose[0, 0]))
        world.advance(np.zeros((1, 2)))
    np.testing.assert_allclose([p[0] for p in places[:10]], 0.0, atol=1e-6)
    np.testing.assert_allclose([p[0] for p in places[10:20]], 1.0, atol=1e-6)
    np.testing.assert_allclose([p[0] for p in places[20:]], 2.0, atol=1e-3)
    np.testing.assert_allclose([p[1] for p in places[:20]], -ROBOT.hand_offset, atol=1e-9)


def test_all_of_it_together_runs_the_same_twice():
    happen = {
        "pushes": [{"robot": 1, "time": 0.2, "duration": 0.3, "force": (1.0, -1.0)}],
        "dead_motors": [{"robot": 2, "side": "right", "time": 0.8}],
        "kidnappings": [KIDNAPPING],
    }
    around = {"moving_boxes": [{"size": (0.2, 0.2), "waypoints": [{"time": 0, "center": (-0.5, 0)}]}]}
    runs = []
    for _ in range(2):
        plan = scenario(2, beams="all", world=around, disturbances=happen, radio={"delay": 0.01, "jitter": 0.03})
        world, rng, seen = MujocoPlant(plan), np.random.default_rng(5), []
        for _ in range(120):
            world.advance(rng.uniform(-6, 6, (2, 2)))
            truth, readings = world.truth(), world.observe()
            seen += [truth.body_pose, truth.wheel_speed, readings.body_pose, readings.ranges]
        runs.append(b"".join(a.tobytes() for a in seen))
    assert runs[0] == runs[1]
