"""Points at a plain wall: how much room they take there, and that a corner is looked for along its face alone."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.estimator import PointMemory
from tests.perceiving import rows
from tests.raycast import Scene
from tests.seeing_points import PERIOD, ROBOT, estimator, scan, sensor

LONG = Scene(((1.0, -6.0, 1.0, 6.0),))
SHORT = Scene(((1.0, -0.5, 1.0, 0.5),))
AWAY = 0.25  # [m] of the body's centre from the wall


def room_taken(preset: str, seed: int) -> list[float]:
    """Return how far short of the truth half-spaces end abreast of a robot that rests at the wall [m]: 12 scans."""
    made, given = estimator(sensor(preset), slots=8)
    given = given.model_copy(update={"seed": seed})
    rng, memory, taken = np.random.default_rng([seed, 21]), made.init(), []
    pose = np.array([[1.0 - AWAY, rng.uniform(-1.0, 1.0), rng.uniform(-0.6, 0.6)]])
    hand = pose[0, :2] + ROBOT.hand_offset * np.array([np.cos(pose[0, 2]), np.sin(pose[0, 2])])
    for frame in range(20):
        known, memory = made.step_towards(scan(given, LONG, pose, frame), frame * PERIOD, memory, hand[None])
        G, h = rows(known)
        ahead = G[:, 0] > 0.9  # none where an outlier beside the robot turned the half-space
        if frame >= 8 and ahead.any():
            reach = np.min((h - G[:, 1] * hand[1])[ahead] / G[ahead, 0])
            taken.append(1.0 - ROBOT.clearance - reach)
    return taken


@pytest.mark.parametrize(("preset", "most"), [("default", 0.035), ("tof_ring", 0.04), ("robotarium", 0.045)])
def test_a_robot_that_rests_at_a_wall_comes_near_it(preset: str, most: float) -> None:
    """In the median of 12 robots; and no half-space lets any of them in nearer than the clearance."""
    taken = np.concatenate([room_taken(preset, seed) for seed in range(12)])
    assert np.median(taken) < most
    assert taken.min() > 0.0


def seen_at(scene: Scene, lost: tuple[int, ...] = (), scans: int = 4, headings: tuple[float, ...] = ()) -> PointMemory:
    """Return what a robot at the origin remembers; in the last scan no echo comes to the beams `lost`.

    Its headings are 0, or in the first scans `headings` and then the last of them [deg].
    """
    made, given = estimator()
    memory = made.init()
    for frame in range(scans):
        heading = np.deg2rad(headings[min(frame, len(headings) - 1)]) if headings else 0.0
        one = scan(given, scene, np.array([[0.0, 0.0, heading]]), frame)
        if frame == scans - 1:
            one.ranges[0, list(lost)] = np.nan
        _, memory = made.step_towards(one, frame * PERIOD, memory, None)
    return memory


def test_a_corner_at_the_end_of_a_face_sticks_out_along_the_face_alone() -> None:
    points = seen_at(SHORT).points[0]
    last = points[points["live"] & (np.abs(points["y"]) > 0.42)]
    assert len(last) >= 4
    half_a_gap = 0.5 * np.deg2rad(5.0) * np.hypot(last["x"], last["y"])
    np.testing.assert_allclose(last["protrusion"], half_a_gap, rtol=0.02)
    across, along = np.abs(last["along_x"]) + last["slack"], np.abs(last["along_y"]) + last["slack"]
    assert np.median(across) < 0.6 * np.median(half_a_gap)
    assert np.all(along > half_a_gap)


def test_neighbours_that_are_lost_once_make_no_corner() -> None:
    """Four beams that are silent in one scan: the echo between them is one of a face in the scans before."""
    for lost in ((), (70, 71, 1, 2)):
        points = seen_at(LONG, lost).points[0]
        newest = points[points["live"] & (points["scan"] == 4) & (np.abs(points["y"]) < 0.02)]
        assert len(newest) == 1
        assert newest["protrusion"][0] <= (0.015 if lost else 0.0)  # half a gap is 0.044 m


def test_a_robot_that_has_turned_knows_no_end_by_the_beam_that_met_the_face_there_before() -> None:
    """A beam that met the face between two others is the last on it now: its corner is as far off as ever.

    At -3.6 deg beams meet the face at 21.4 and 26.4 deg, and it ends at 26.6 deg. At -1.5 deg one meets it at 23.5 deg,
    next to where that of 21.4 deg has told of no corner, and the next one passes.
    """
    turned, never = (
        seen_at(SHORT, scans=12, headings=headings).points[0] for headings in ((-3.6, -3.6, -1.5), (-1.5,))
    )
    bounds = []
    for points in (turned, never):
        last = points[points["live"] & (points["scan"] == 12) & (np.abs(points["y"] - 0.435) < 0.02)]
        assert len(last) == 1
        bounds.append(min(last["protrusion"][0], abs(last["along_y"][0]) + last["slack"][0]))
    assert bounds[1] > 0.04
    assert bounds[0] > 0.9 * bounds[1]


@pytest.mark.parametrize(("lost", "least", "most"), [((1, 2), 0.0, 0.01), ((70, 71), 0.03, 0.05)])
def test_an_echo_beside_another_knows_what_is_on_its_side(lost: tuple[int, ...], least: float, most: float) -> None:
    """Turned by 1.5 deg to the right, with two beams silent: on the left echoes of before go on, on the right not."""
    points = seen_at(LONG, lost, headings=(1.5, 1.5, 1.5, 0.0)).points[0]
    newest = points[points["live"] & (points["scan"] == 4) & (np.abs(points["y"]) < 0.02)]
    assert len(newest) == 1
    assert least <= newest["protrusion"][0] < most
