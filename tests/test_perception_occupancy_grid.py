"""What a robot knows of its blind sides: free where scans or its body have been, and there it stays, in the world."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from tests.perceiving import rows
from tests.raycast import Scene
from tests.seeing_points import PERIOD, ROBOT, estimator, scan
from tests.test_perception_known_free import CROSS, L_SHAPE, U_SHAPE, admitted, around, clutter, distances

OPEN = Scene(((50.0, -1.0, 50.0, 1.0),))
NOWHERE = np.array([[0.0, 0.0]])


def ahead(sweep: int) -> dict:
    """A sensor with beams 2 degrees apart."""
    return {"beams": {"sweep_deg": float(sweep), "start_deg": -sweep / 2, "count": sweep // 2 + 1}}


AHEAD = ahead(150)


def hand(pose: np.ndarray) -> np.ndarray:
    return pose[:2] + ROBOT.hand_offset * np.array([np.cos(pose[2]), np.sin(pose[2])])


def seen_from(poses: list[np.ndarray], scene: Scene = OPEN) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield G and h after each scan of a robot that is sent to the origin; it sees what is ahead of it alone."""
    made, given = estimator(AHEAD, slots=8, unknown="closed")
    memory = made.init()
    for frame, pose in enumerate(poses):
        known, memory = made.step_towards(scan(given, scene, pose[None], frame), frame * PERIOD, memory, NOWHERE)
        yield rows(known)


def farthest_back(pose: np.ndarray, G: np.ndarray, h: np.ndarray) -> float:
    """Return the x to which the hand point of a robot that heads along +x may go back."""
    back = G[:, 0] < -1e-9
    return float(((G[back, 1] * pose[1] - h[back]) / -G[back, 0]).max())


def test_who_goes_back_meets_the_edge_of_what_it_knew() -> None:
    """8 mm a scan, 10 cm in all: the edge does not go with it, and it is not admitted to where it goes."""
    poses = [np.array([-0.008 * k, 0.0, 0.0]) for k in range(14)]
    edges = [farthest_back(pose, *known) for pose, known in zip(poses, seen_from(poses), strict=True)]
    assert min(edges) > edges[0] - ROBOT.clearance / 4
    assert edges[-1] > hand(poses[-1])[0]


def test_who_stays_knows_its_edge_as_long_as_it_stays() -> None:
    poses = [np.zeros(3)] * 200
    edges = [farthest_back(pose, *known) for pose, known in zip(poses, seen_from(poses), strict=True)]
    assert np.ptp(edges) < ROBOT.clearance / 8 + 0.005
    assert max(edges) < hand(poses[0])[0]


def test_who_went_ahead_may_go_back_to_where_it_was() -> None:
    poses = [np.array([0.01 * k, 0.0, 0.0]) for k in range(13)]
    *_, last = seen_from(poses)
    first_edge = farthest_back(poses[0], *next(seen_from(poses)))
    assert farthest_back(poses[-1], *last) < first_edge + ROBOT.clearance / 8 + 0.005
    assert farthest_back(poses[-1], *last) < hand(poses[-1])[0] - ROBOT.clearance


def test_who_is_somewhere_else_all_at_once_knows_of_the_disc_in_which_it_turns() -> None:
    poses = [np.zeros(3)] * 5 + [np.array([3.0, 1.0, 0.0])] * 5
    *_, last = seen_from(poses)
    assert 3.0 - ROBOT.clearance < farthest_back(poses[-1], *last) < hand(poses[-1])[0]


@pytest.mark.parametrize("sweep", [120, 210])
def test_no_point_that_a_robot_may_go_to_is_nearer_to_a_solid_than_the_clearance(sweep: int) -> None:
    """Robots go anywhere that they may, at any heading: back and sideways, too, where they have never looked."""
    moved = 0.0
    scenes = [around(shape, 10 + seed) for seed in range(3) for shape in (L_SHAPE, U_SHAPE, CROSS)]
    for seed, scene in enumerate([*scenes, clutter(5), clutter(6)]):
        made, given = estimator(ahead(sweep), slots=8, unknown="closed")
        given, rng = given.model_copy(update={"seed": seed}), np.random.default_rng([seed, 15])
        pose, memory = np.array([0.0, 0.0, rng.uniform(0, 2 * np.pi)]), made.init()
        course = rng.uniform(0, 2 * np.pi)
        for frame in range(60):
            goal = pose[:2] + np.array([np.cos(course), np.sin(course)])
            known, memory = made.step_towards(scan(given, scene, pose[None], frame), frame * PERIOD, memory, goal[None])
            G, h = rows(known)
            if frame >= 2:
                points = admitted(pose, G, h, seed)
                assert not len(points) or distances(scene, points).min() > ROBOT.clearance - 0.01
            course += rng.normal(0.0, 0.1)
            step = 0.02 * np.array([np.cos(course), np.sin(course)])
            if np.all(G @ (hand(pose) + step) <= h):
                pose = pose + np.array([*step, rng.normal(0.0, 0.01)])
                moved += 0.02
            else:
                course = rng.uniform(0, 2 * np.pi)
    assert moved > 2.0


def test_cells_are_kept_where_beams_may_leave_a_side_out_alone() -> None:
    for sensors, unknown, kept in (
        (AHEAD, "free", False),
        (AHEAD, "closed", True),
        ({}, "closed", False),
        ({}, "strict", True),
        ({"beams": {"sweep_deg": 250.0}}, "closed", False),
        ({"beams": {"robots": []}}, "closed", False),
    ):
        assert (estimator(sensors, unknown=unknown)[0].parameters.cells > 0) == kept
