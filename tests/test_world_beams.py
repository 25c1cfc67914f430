from itertools import pairwise

import numpy as np
import pytest

from pbrg_mj.world.mujoco_world import MujocoWorld
from pbrg_mj.world.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()


def ray_to_rectangle(origin: np.ndarray, angle: float, w: dict) -> float:
    """Return the distance along a ray to a wall by the slab method; inf for a miss."""
    a, b = np.array(w["from"]), np.array(w["to"])
    along = (b - a) / np.linalg.norm(b - a)
    turn = np.array([along, [-along[1], along[0]]])
    o, d = turn @ (origin - (a + b) / 2), turn @ [np.cos(angle), np.sin(angle)]
    half = np.array([np.linalg.norm(b - a), w["thickness"]]) / 2
    near, far = np.sort([(-half - o) / d, (half - o) / d], axis=0)
    return near.max() if near.max() <= far.min() and far.min() > 0 else np.inf


def test_ranges_agree_with_rays_against_rectangles():
    walls = (wall((1.5, -1.0), (1.1, 2.0)), wall((-1, -0.7), (0.9, -0.9), 0.3))
    world = MujocoWorld(scenario(walls=walls, beams={"robots": "all", "count": 90}, team={"heading_deg": 17.0}))
    seen = world.observe()
    assert seen.ranges.shape == (1, 90)
    x, y, heading = seen.body_pose[0]
    angles = heading + 2 * np.pi * np.arange(90) / 90
    want = np.array([min(ray_to_rectangle(np.array([x, y]), a, w) for w in walls) for a in angles])
    want[np.isinf(want)] = -1
    np.testing.assert_allclose(seen.ranges[0], want, atol=1e-9)
    assert (want > 0).sum() > 30


def test_no_part_of_the_robot_hides_its_own_beams():
    seen = MujocoWorld(scenario(beams="all")).observe().ranges[0]
    np.testing.assert_array_equal(seen, -1.0)


def test_beams_see_other_robots():
    seen = MujocoWorld(scenario(2, beams="all")).observe().ranges
    np.testing.assert_allclose(seen[[0, 1], [0, 36]], 0.5 - ROBOT.body_radius, atol=1e-6)  # the other's plate


def test_only_carriers_have_rows_in_ascending_order():
    walls = (wall((3, -1), (3, 1)),)
    seen = MujocoWorld(scenario(3, walls=walls, beams={"robots": (3, 1), "count": 4})).observe()
    assert seen.ranges.shape == (2, 4)
    np.testing.assert_allclose(seen.ranges[:, 0], [0.5 - ROBOT.body_radius, 3 - 0.05 - (1.0 - 0.04)], atol=1e-6)
    none = MujocoWorld(scenario(3, beams=())).observe()
    assert none.ranges.shape == (0, 72)
    assert none.scan_frame == -1


def test_readings_are_held_between_samples_and_counted():
    sections = {"camera": {"rate_hz": 30.0}}
    world = MujocoWorld(scenario(beams="all", sensors=sections, walls=(wall((2, -1), (2, 1)),)))
    seen = []
    for _ in range(31):
        seen.append(world.observe())
        world.advance(np.full((1, 2), 3.0))
    for before, after in pairwise(seen[1:]):
        assert (after.pose_frame > before.pose_frame) == (not np.array_equal(after.body_pose, before.body_pose))
        assert (after.scan_frame > before.scan_frame) == (not np.array_equal(after.ranges, before.ranges))
    assert (seen[-1].pose_frame, seen[-1].scan_frame) == (9, 3)


def test_readings_at_a_sampling_tick_are_the_truth_of_that_very_instant():
    world = MujocoWorld(scenario(beams=(), sensors={"camera": {"rate_hz": 100.0}}))
    for tick in range(20):
        assert world.observe().pose_frame == tick
        np.testing.assert_allclose(world.observe().body_pose, world.truth().body_pose, atol=1e-12)
        world.advance(np.array([[2.0, 4.0]]))


@pytest.mark.parametrize("count", [1, 7])
def test_any_number_of_beams(count):
    assert MujocoWorld(scenario(2, beams={"count": count})).observe().ranges.shape == (2, count)


@pytest.mark.parametrize("heading", [0.0, 45.0, 90.0])
def test_beams_see_the_plates_of_other_robots_and_never_their_wheels(heading: float):
    world = MujocoWorld(scenario(2, beams={"robots": (1,), "count": 720}, team={"heading_deg": [0.0, heading]}))
    seen = world.observe()
    hit = seen.ranges[0] > 0
    angle = seen.body_pose[0, 2] + 2 * np.pi * np.flatnonzero(hit) / 720
    points = seen.body_pose[0, :2] + seen.ranges[0, hit, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    assert hit.sum() > 20
    np.testing.assert_allclose(np.linalg.norm(points - seen.body_pose[1, :2], axis=1), ROBOT.body_radius, atol=1e-6)
