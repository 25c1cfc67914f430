"""From readings to half-spaces in slots, over time."""

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.setup import PerceptionSetup, perception_setup
from pbrg_mj.scenario.schema import Estimator, Scenario
from pbrg_mj.sensing.readings import Readings
from tests.raycast import Scene, cast, moved_pose

BEAMS, CLEARANCE = 72, 0.1
WALL = Scene(((1.0, -3.0, 1.0, 3.0),))
CORNER = Scene(((1.0, -3.0, 1.0, 1.2), (1.0, 1.2, -3.0, 1.2)))
POSES = np.array([[0.0, 0.0, 0.3], [0.4, -0.5, 2.0], [-0.2, 0.6, -2.0]])


def setup(robots: int = 3, beams: str | tuple[int, ...] = "all", **estimator: object) -> PerceptionSetup:
    return perception_setup(scenario(robots, beams, **estimator), CLEARANCE)


def scenario(robots: int = 3, beams: str | tuple[int, ...] = "all", **estimator: object) -> Scenario:
    team = {"start": [(0, 0)] * robots, "formation": [(0, 0)] * robots, "leaders": [1]}
    return Scenario.model_validate(
        {
            "team": team,
            "operator": {"reference": (0, 0)},
            "sensors": {"beams": {"robots": beams}},
            "estimator": estimator,
        }
    )


def exact(robots: int = 3, **estimator: object) -> PerceptionSetup:
    """Half-spaces where the walls are seen, without the margin for what is uncertain."""
    return setup(robots, sigmas=0.0, **estimator)


def readings(scene: Scene, poses: np.ndarray, noise: np.random.Generator | None = None) -> Readings:
    ranges = np.array([cast(scene, pose, BEAMS) for pose in poses])
    if noise is not None:
        ranges += 0.005 * noise.standard_normal(ranges.shape)
    return Readings(poses, ranges, True, 0, 0)


def once(scene: Scene, poses: np.ndarray) -> HalfSpaces:
    """What is known after two scans, enough for a long wall."""
    config = exact(len(poses))
    _, memory = perceive(readings(scene, poses), 0.0, initial(config), config)
    return perceive(readings(scene, poses), 0.1, memory, config)[0]


def held(before: Readings) -> Readings:
    return Readings(before.body_pose + 0.1, before.ranges, False, 1, before.scan_frame)


def test_every_robot_gets_the_wall_moved_inward() -> None:
    half_spaces = once(WALL, POSES)
    assert half_spaces.active.tolist() == [[True, False, False, False]] * 3
    assert half_spaces.G[:, 0] == pytest.approx(np.tile([1.0, 0.0], (3, 1)), abs=1e-9)
    assert half_spaces.h[:, 0] == pytest.approx(0.9, abs=1e-9)
    assert not half_spaces.G[:, 1:].any() and not half_spaces.h[:, 1:].any()


def test_a_corner_gives_both_half_spaces_nearest_first() -> None:
    half_spaces = once(CORNER, POSES[:1])
    assert half_spaces.active[0].tolist() == [True, True, False, False]
    assert half_spaces.G[0, :2] == pytest.approx(np.eye(2), abs=1e-9)
    assert half_spaces.h[0, :2] == pytest.approx([0.9, 1.1], abs=1e-9)


@pytest.mark.parametrize("motion", [(0.0, 0.0, 1.0), (5.0, -3.0, 0.0), (-2.0, 7.0, -2.5)])
def test_a_rigid_motion_moves_the_half_spaces_along(motion: tuple[float, float, float]) -> None:
    still = once(CORNER, POSES)
    moved = once(CORNER.moved(*motion), np.array([moved_pose(pose, *motion) for pose in POSES]))
    c, s = np.cos(motion[2]), np.sin(motion[2])
    turned = still.G @ np.array([[c, -s], [s, c]]).T
    assert np.array_equal(moved.active, still.active) and still.active.sum() == 6
    assert pytest.approx(turned, abs=1e-9) == moved.G
    assert moved.h == pytest.approx(still.h + turned @ np.array(motion[:2]), abs=1e-9)


def test_permuting_robots_permutes_the_half_spaces() -> None:
    order = [2, 0, 1]
    still, permuted = once(CORNER, POSES), once(CORNER, POSES[order])
    assert np.array_equal(permuted.G, still.G[order]) and np.array_equal(permuted.h, still.h[order])


def test_a_half_space_contains_its_robot_unless_it_stands_too_near() -> None:
    random = np.random.default_rng(9)
    for _ in range(50):
        pose = np.array([[random.uniform(-1, 0.85), random.uniform(-1, 1), random.uniform(-3, 3)]])
        half_spaces = once(CORNER, pose)
        slack = (half_spaces.h[0] - half_spaces.G[0] @ pose[0, :2])[half_spaces.active[0]]
        assert len(slack) == 2 and np.all(slack > 0)
    near = once(WALL, np.array([[0.95, 0.0, 0.0]]))
    assert near.h[0, 0] == pytest.approx(0.9, abs=1e-9) and near.G[0, 0] == pytest.approx([1, 0], abs=1e-9)


def test_half_spaces_are_held_between_scans() -> None:
    config = setup()
    scan = readings(CORNER, POSES)
    first, memory = perceive(scan, 0.0, initial(config), config)
    second, memory = perceive(held(scan), 7.0, memory, config)
    assert np.array_equal(first.G, second.G) and np.array_equal(first.h, second.h)
    assert np.array_equal(first.active, second.active)


def test_nothing_is_known_before_the_first_scan() -> None:
    config = setup()
    blind = Readings(POSES, np.full((3, BEAMS), np.nan), False, -1, -1)
    assert not perceive(blind, 0.0, initial(config), config)[0].active.any()


def test_only_the_nearest_walls_are_kept() -> None:
    config = exact(1, half_spaces_per_robot=1)
    far, memory = perceive(readings(Scene(((-2.0, -3.0, -2.0, 3.0),)), POSES[:1]), 0.0, initial(config), config)
    assert far.h[0] == pytest.approx([1.9], abs=1e-9)
    _, memory = perceive(readings(CORNER, POSES[:1]), 0.1, memory, config)
    both, memory = perceive(readings(CORNER, POSES[:1]), 0.2, memory, config)
    assert both.h[0] == pytest.approx([0.9], abs=1e-9) and both.G[0, 0] == pytest.approx([1, 0], abs=1e-9)
    farther, _ = perceive(readings(Scene(((-2.0, -3.0, -2.0, 3.0),)), POSES[:1]), 0.3, memory, config)
    assert np.array_equal(farther.h, both.h)


def test_only_robots_with_beams_see() -> None:
    config = setup(3, (2,), sigmas=0.0)
    scan = readings(WALL, POSES)
    seen = Readings(POSES, scan.ranges[1:2], True, 0, 0)
    half_spaces, _ = perceive(seen, 0.0, initial(config), config)
    assert half_spaces.active.any(axis=1).tolist() == [False, True, False]
    assert half_spaces.h[1, 0] == pytest.approx(0.9, abs=1e-9)


def given(*rows: tuple[int, tuple[float, float], float]) -> list[dict[str, object]]:
    return [{"robot": robot, "normal": normal, "offset": offset} for robot, normal, offset in rows]


def test_given_half_spaces_are_used_as_they_are() -> None:
    config = setup(3, source="given", given=given((3, (3, 4), 10), (1, (0, -2), 1), (3, (1, 0), 2)))
    half_spaces, memory = perceive(readings(WALL, POSES), 0.0, initial(config), config)
    assert half_spaces.active.tolist() == [
        [True, False, False, False],
        [False] * 4,
        [True, True, False, False],
    ]
    assert half_spaces.G[2, :2] == pytest.approx(np.array([[0.6, 0.8], [1, 0]]))
    assert half_spaces.h[2, :2] == pytest.approx([2, 2]) and half_spaces.h[0, 0] == pytest.approx(0.5)
    assert half_spaces.G[0, 0] == pytest.approx([0, -1])
    assert np.array_equal(perceive(readings(Scene(), POSES), 99.0, memory, config)[0].h, half_spaces.h)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([(1, (1, 0), 0)] * 5, "robot 1 is given more half-spaces than the 4 it can hold"),
        ([(4, (1, 0), 0)], "4 is no robot; allowed are 1 to 3"),
        ([(1, (0, 0), 0)], "has no direction"),
    ],
)
def test_wrong_given_half_spaces_are_refused(rows: list, message: str) -> None:
    with pytest.raises(InputError, match=message):
        setup(3, source="given", given=given(*rows))


def test_noise_sets_the_rules() -> None:
    assert setup().line_params.range_std == 0.005
    assert Estimator().split_distance == setup().line_params.split_distance
    cheap = scenario().model_copy(update={"plant": "ideal"})
    assert perception_setup(cheap, CLEARANCE).line_params.range_std == 1e-3
