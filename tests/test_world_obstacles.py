"""Boxes that stand, and boxes that move: seen at the right range, touched, and counted as walls or not."""

import numpy as np
import pytest

from pbrg_mj.scenario.schema import Box, MovingBox
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.footprints import footprints_of, signed_distance
from pbrg_mj.world.scene.obstacles import box_centre
from pbrg_mj.world.scene.robot import load_robot_model
from tests.test_world_footprints import inside
from tests.worlds import scenario, wall

ROBOT = load_robot_model()


def box_corners(box: Box) -> np.ndarray:
    """Return the corners of a box in order, by turning them about its centre."""
    turn = np.deg2rad(box.angle_deg)
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    half = np.array(box.size) / 2
    return np.array(box.center) + np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half @ R.T


def test_margins_of_boxes_agree_with_the_nearest_of_many_points():
    rng = np.random.default_rng(8)
    for _ in range(10):
        size, angle = tuple(rng.uniform(0.05, 1.5, 2)), rng.uniform(-400, 400)
        box = Box(center=tuple(rng.uniform(-1, 1, 2)), size=size, angle_deg=angle)
        corners = box_corners(box)
        s = np.linspace(0, 1, 4000)[:, None]
        faces = np.vstack([a + s * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
        points = rng.uniform(-2, 2, (30, 2))
        got = signed_distance(points, footprints_of([box.as_wall()]))[:, 0]
        for point, distance in zip(points, got, strict=True):
            sign = -1 if inside(point, corners) else 1
            assert distance == pytest.approx(sign * np.linalg.norm(faces - point, axis=1).min(), abs=1e-3)


def test_a_box_at_the_rim_of_what_is_allowed_has_ends_beyond_it():
    wall = Box(center=(1e6, 0.0), size=(1e9, 0.5)).as_wall()
    assert wall.start == (1e6 - 5e8, 0.0)
    assert wall.end == (1e6 + 5e8, 0.0)


def test_boxes_stand_in_physics_where_the_margin_has_them():
    """Margin and beam agree: straight ahead lies the nearest corner of a turned box."""
    boxes = [{"center": (1.0, 0.0), "size": (0.4, 0.4), "angle_deg": 45.0}]
    world = MujocoPlant(scenario(beams={"count": 4}, world={"boxes": boxes}))
    corner = 1.0 - 0.2 * np.sqrt(2)
    assert world.truth().wall_margin[0] == pytest.approx(corner - ROBOT.clearance, abs=1e-9)
    assert world.observe().ranges[0, 0] == pytest.approx(corner + ROBOT.hand_offset, abs=1e-9)


def test_the_least_of_walls_and_boxes_counts():
    boxes = [{"center": (0.0, -0.8), "size": (4.0, 0.2)}]
    plan = scenario(2, walls=(wall((1.0, -1), (1.0, 1)),), world={"boxes": boxes, "walls": (wall((1, -1), (1, 1)),)})
    np.testing.assert_allclose(MujocoPlant(plan).truth().wall_margin, [0.7 - 0.1, 0.45 - 0.1], atol=1e-9)


def drive_into(around: dict) -> tuple[MujocoPlant, list[bool]]:
    world = MujocoPlant(scenario(world=around))
    touched = []
    for _ in range(100):
        world.advance(np.full((1, 2), 3.0))
        touched.append(world.truth().wall_contact[0])
    return world, touched


def test_touching_a_box_counts_and_touching_a_moving_box_does_not():
    still, touched = drive_into({"boxes": [{"center": (0.4, 0.0), "size": (0.2, 0.2)}]})
    moving = {"size": (0.2, 0.2), "waypoints": [{"time": 0.0, "center": (0.4, 0.0)}]}
    passing, bumped = drive_into({"moving_boxes": [moving]})
    assert any(touched)
    assert not any(bumped)
    for world in (still, passing):  # both stop the robot: its front stands at the face
        assert world.truth().body_pose[0, 0] == pytest.approx(0.3 - ROBOT.body_radius, abs=5e-3)
    assert np.isinf(passing.truth().wall_margin[0])


STOPS = [{"time": 0.5, "center": (1.0, 0.0)}, {"time": 1.5, "center": (2.0, 0.0)}, {"time": 2.0, "center": (2.0, -3.0)}]


@pytest.mark.parametrize(
    ("time", "centre"),
    [(0, (1, 0)), (0.5, (1, 0)), (0.75, (1.25, 0)), (1.5, (2, 0)), (1.75, (2, -1.5)), (2, (2, -3)), (9, (2, -3))],
)
def test_a_moving_box_rests_and_moves_between_its_stops(time, centre):
    box = MovingBox.model_validate({"size": (0.2, 0.4), "waypoints": STOPS})
    np.testing.assert_allclose(box_centre(box, time), centre, atol=1e-12)


def test_beams_see_a_moving_box_at_the_range_of_its_face():
    """Robot 1's first beam looks along +x, and a scan at every physics step shows the box of that very step."""
    around = {"moving_boxes": [{"size": (0.2, 0.4), "waypoints": STOPS}]}
    world = MujocoPlant(scenario(beams={"count": 1, "rate_hz": 500.0}, world=around))
    for tick in range(200):
        x, y = box_centre(MovingBox.model_validate({"size": (0.2, 0.4), "waypoints": STOPS}), tick * 0.01)
        face = x - 0.1 + ROBOT.hand_offset if abs(y) < 0.2 else -1.0
        got = world.observe().ranges[0, 0]
        assert (got if got < 10 else -1.0) == pytest.approx(face, abs=1e-3), tick  # 10 m and more: the floor
        world.advance(np.zeros((1, 2)))


def test_a_moving_box_pushes_a_robot_out_of_its_way():
    stops = [{"time": 0.0, "center": (-0.5, 0.0)}, {"time": 2.0, "center": (0.1, 0.0)}]
    world = MujocoPlant(scenario(world={"moving_boxes": [{"size": (0.2, 0.2), "waypoints": stops}]}))
    for _ in range(220):
        world.advance(np.zeros((1, 2)))
    gap = world.truth().body_pose[0, 0] - (0.2 + ROBOT.body_radius)
    assert -0.002 < gap < 0.03  # nudged ahead, for contacts with what is driven are bumps


@pytest.mark.parametrize(
    "thing",
    [
        {"walls": [{"from": (1.0, -1.0), "to": (1.0, 1.0), "thickness": 0.02}]},
        {"boxes": [{"center": (1.1, 0.0), "size": (0.2, 0.5)}]},
        {"columns": [{"center": (1.1, 0.0), "radius": 0.1}]},
        {"prisms": [{"corners": [(1.0, -0.3), (1.2, -0.3), (1.2, 0.3), (1.0, 0.3)]}]},
    ],
    ids=lambda thing: next(iter(thing)),
)
def test_beams_pass_through_glass_and_robots_do_not(thing):
    [(kind, [entry])] = thing.items()
    behind = wall((2.0, -1.0), (2.0, 1.0))
    ranges, stopped = {}, {}
    for glass in (False, True):
        around = {"walls": [behind]}
        around[kind] = [*around.get(kind, []), entry | {"glass": glass}]
        plant = MujocoPlant(scenario(beams={"count": 4}, world=around))
        ranges[glass] = plant.observe().ranges[0, 0]
        for _ in range(250):
            plant.advance(np.full((1, 2), 3.0))
        stopped[glass] = plant.truth()
    assert ranges[False] < 1.1 and ranges[True] == pytest.approx(1.95 + plant.robot.hand_offset, abs=1e-6)
    assert stopped[True].wall_contact[0] and stopped[True].hand_world[0, 0] < 1.0
    np.testing.assert_array_equal(stopped[True].hand_world, stopped[False].hand_world)
