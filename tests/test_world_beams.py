from itertools import pairwise

import mujoco
import numpy as np
import pytest

from pbrg_mj.perception.scan import self_occlusion as own_wheels
from pbrg_mj.perception.scan.self_occlusion import blocked_beams
from pbrg_mj.scenario.schema import Beams
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot, load_robot_model
from tests import raycast
from tests.raycast import Scene, cast
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
    world = MujocoPlant(scenario(walls=walls, beams={"robots": "all", "count": 90}, team={"heading_deg": 17.0}))
    seen = world.observe()
    assert seen.ranges.shape == (1, 90)
    x, y, heading = seen.body_pose[0]
    angles = heading + 2 * np.pi * np.arange(90) / 90
    want = np.array([min(ray_to_rectangle(np.array([x, y]), a, w) for w in walls) for a in angles])
    want[np.isinf(want)] = -1
    np.testing.assert_allclose(seen.ranges[0], want, atol=1e-9)
    assert (want > 0).sum() > 30


def test_no_part_of_the_robot_hides_its_own_beams():
    seen = MujocoPlant(scenario(beams="all")).observe().ranges[0]
    np.testing.assert_array_equal(seen, -1.0)


def test_beams_see_other_robots():
    seen = MujocoPlant(scenario(2, beams="all")).observe().ranges
    np.testing.assert_allclose(seen[[0, 1], [0, 36]], 0.5 - ROBOT.body_radius, atol=1e-6)  # the other's plate


def test_only_carriers_have_rows_in_ascending_order():
    walls = (wall((3, -1), (3, 1)),)
    seen = MujocoPlant(scenario(3, walls=walls, beams={"robots": (3, 1), "count": 4})).observe()
    assert seen.ranges.shape == (2, 4)
    np.testing.assert_allclose(seen.ranges[:, 0], [0.5 - ROBOT.body_radius, 3 - 0.05 - (1.0 - 0.04)], atol=1e-6)
    none = MujocoPlant(scenario(3, beams=())).observe()
    assert none.ranges.shape == (0, 72)
    assert none.scan_frame == -1


def test_readings_are_held_between_samples_and_counted():
    sections = {"camera": {"rate_hz": 30.0}}
    world = MujocoPlant(scenario(beams="all", sensors=sections, walls=(wall((2, -1), (2, 1)),)))
    seen = []
    for _ in range(31):
        seen.append(world.observe())
        world.advance(np.full((1, 2), 3.0))
    for before, after in pairwise(seen[1:]):
        assert (after.pose_frame > before.pose_frame) == (not np.array_equal(after.body_pose, before.body_pose))
        assert (after.scan_frame > before.scan_frame) == (not np.array_equal(after.ranges, before.ranges))
    assert (seen[-1].pose_frame, seen[-1].scan_frame) == (9, 3)


def test_readings_at_a_sampling_tick_are_the_truth_of_that_very_instant():
    world = MujocoPlant(scenario(beams=(), sensors={"camera": {"rate_hz": 100.0}}))
    for tick in range(20):
        assert world.observe().pose_frame == tick
        np.testing.assert_allclose(world.observe().body_pose, world.truth().body_pose, atol=1e-12)
        world.advance(np.array([[2.0, 4.0]]))


@pytest.mark.parametrize("count", [1, 7])
def test_any_number_of_beams(count):
    assert MujocoPlant(scenario(2, beams={"count": count})).observe().ranges.shape == (2, count)


@pytest.mark.parametrize("heading", [0.0, 45.0, 90.0])
def test_beams_see_the_plates_of_other_robots_and_never_their_wheels(heading: float):
    world = MujocoPlant(scenario(2, beams={"robots": (1,), "count": 720}, team={"heading_deg": [0.0, heading]}))
    seen = world.observe()
    hit = seen.ranges[0] > 0
    angle = seen.body_pose[0, 2] + 2 * np.pi * np.flatnonzero(hit) / 720
    points = seen.body_pose[0, :2] + seen.ranges[0, hit, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    assert hit.sum() > 20
    np.testing.assert_allclose(np.linalg.norm(points - seen.body_pose[1, :2], axis=1), ROBOT.body_radius, atol=1e-6)


@pytest.mark.parametrize("height", [0.025, 0.03, 0.037])
@pytest.mark.parametrize("heading", [0.0, 20.0, 55.0, 90.0])
def test_low_beams_see_tubs_and_wheels(height: float, heading: float):
    """Rays against circles and rectangles; the wheels' spokes are level with their axles, lower than the beams."""
    seen = MujocoPlant(
        scenario(2, beams={"count": 720, "height": height}, team={"heading_deg": [0.0, heading]})
    ).observe()
    shapes = [raycast.robot(pose, height) for pose in seen.body_pose]
    own = [raycast.wheels(pose, height) for pose in seen.body_pose]
    for me, other in ((0, 1), (1, 0)):
        want = np.nan_to_num(cast(shapes[other] + own[me], seen.body_pose[me], 720), nan=-1.0)
        np.testing.assert_allclose(seen.ranges[me], want, atol=1e-6)
    bare = cast(Scene((), shapes[1].discs) + own[0], seen.body_pose[0], 720)
    on_wheels = (seen.ranges[0] > 0) & ~(np.abs(seen.ranges[0] - bare) < 1e-6)
    assert on_wheels.sum() >= 4


@pytest.mark.parametrize("layout", [{"count": 720}, {"count": 72}, {"count": 90, "start_deg": 7.0, "sweep_deg": 200.0}])
@pytest.mark.parametrize("height", [0.02, 0.03, 0.0395, 0.045, 0.049])
def test_low_beams_are_blind_where_their_own_wheels_are(height: float, layout: dict):
    blocked = blocked_beams(Beams(height=height, **layout))
    world = MujocoPlant(scenario(beams={"rate_hz": 100.0, "height": height, **layout}))
    for k in range(40):  # wheels turn, the body pitches
        seen = world.observe().ranges[0]
        wheels = (seen > 0) & (seen < ROBOT.body_radius)
        assert not (wheels & ~blocked).any()
        assert (blocked & ~wheels).sum() <= 4  # one that just passes, at each end of each wheel
        assert wheels.any() == blocked.any() == (height < 0.04)
        world.advance(np.array([[6.0, 5.0]] if k < 20 else [[-6.0, -5.0]]))


def test_the_numbers_of_wheels_are_those_of_the_model():
    model = load_robot().compile()
    rim = next(
        geom
        for geom in map(model.geom, range(model.ngeom))
        if geom.bodyid[0] == model.body("wheel_left").id and geom.type[0] == mujoco.mjtGeom.mjGEOM_CYLINDER
    )
    left = float(model.body("wheel_left").pos[1])
    assert own_wheels.RADIUS == raycast.WHEEL == rim.size[0]
    assert (own_wheels.INNER, raycast.WHEELS[0][1]) == pytest.approx(
        (left - rim.size[1], left + rim.size[1]), abs=1e-12
    )
    assert (model.geom("tub").size[0], model.geom("bumper").size[0]) == (raycast.TUB, raycast.PLATE)
    axle = model.body("robot").pos[2]
    assert axle + model.body("wheel_left").pos[2] + rim.size[0] == raycast.WHEELS_TOP
    assert axle + model.site("beams").pos[2] == Beams().height


@pytest.mark.parametrize(("height", "radius"), [(0.02, 0.043), (0.04, 0.043), (0.045, 0.06), (0.053, 0.06)])
def test_beams_of_any_height_meet_other_robots(height: float, radius: float):
    seen = MujocoPlant(scenario(2, beams={"robots": (1,), "count": 4, "height": height})).observe().ranges
    assert seen[0, 0] == pytest.approx(0.5 - radius, abs=1e-6)
