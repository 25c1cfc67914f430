"""Cameras: what they see follows from closed forms, and what matters is in the picture."""

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.video.camera import camera_path, perspective_camera, top_camera
from pbrg_mj.video.framing import Viewport, nearest_eye, top_view
from pbrg_mj.video.playback import motion_of
from pbrg_mj.video.settings import (
    LAYERS,
    Clip,
    RenderTask,
    check_camera,
    check_size,
    frame_times,
    shown_layers,
    still_time,
)
from tests.runs import resting, run, scenario

SIZE = (640, 360)
TICKS = 0.5 * np.arange(21)


def moving():
    """Two robots that drive 6 m to the right and 2 m up in 10 s."""
    ticks = resting(scenario())
    q = ticks.hand_true + np.linspace(0, 1, 21)[:, None, None] * [6.0, 2.0]
    pose = np.concatenate([q - [0.04, 0.0], np.zeros((21, 2, 1))], axis=2)
    return run(ticks={"hand_true": q, "body_pose_true": pose})


def job(camera, made):
    return RenderTask(made, {}, camera, SIZE, frozenset(LAYERS), made.ticks.time)


def inside(pixels):
    return np.all((pixels > 0) & (pixels < SIZE))


def test_from_above_metres_are_pixels():
    """A picture 360 high that shows 4 m has 90 pixels a metre; y points up."""
    camera = top_camera(np.array([1.0, 2.0]), half_height=2.0, mark=0.1)
    points = np.array([[1.0, 2.0, 0.0], [2.0, 2.0, 0.3], [1.0, 3.0, 0.0]])
    np.testing.assert_allclose(camera.project(points, SIZE), [[320, 180], [410, 180], [320, 90]], atol=1e-9)


def test_a_perspective_shrinks_with_distance():
    """At distance d a metre to the right is half of the height over (d tan) pixels."""
    camera = perspective_camera(np.array([0.0, -4.0, 0.0]), np.zeros(3), 0.5, 50.0, 0.1)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 4.0, 0.0], [0.0, 0.0, 1.0]])
    expected = [[320, 180], [320 + 180 / 2, 180], [320 + 180 / 4, 180], [320, 180 - 180 / 2]]
    np.testing.assert_allclose(camera.project(points, SIZE), expected, atol=1e-9)


@pytest.mark.parametrize("camera", ["top", "chase"])
def test_team_and_reference_are_always_in_the_picture(camera):
    made = moving()
    shot = camera_path(job(camera, made), motion_of(made.ticks))
    for k in range(21):
        seen = np.vstack([made.ticks.hand_true[k], made.ticks.m[k], made.ticks.reference[k]])
        assert inside(shot(TICKS[k]).project(np.column_stack([seen, np.zeros(len(seen))]), SIZE))


def test_from_above_what_stands_near_the_team_is_in_the_picture():
    """Robots rest in two places a metre apart; the wall is 0.7 m beyond the upper one, the other one far away."""
    near, far = ({"from": (0.5, y), "to": (1.5, y), "thickness": 0.1} for y in (0.7, 9.0))
    made = run(scenario(plant="physics", world={"walls": (near, far)}, estimator={}))
    shot = camera_path(job("top", made), motion_of(made.ticks))(0.0)
    corners = np.array([[x, y, 0.0] for x in (0.5, 1.5) for y in (0.65, 0.75)])
    assert inside(shot.project(corners, SIZE))
    assert not inside(shot.project(corners + np.array([0.0, 8.3, 0.0]), SIZE))


WIDE = (1280, 720)
COLUMN = 212  # width of the words at the left of such a picture, measured [pixels]


def among_things():
    """The team that drives to (7, 2) passes a box, comes to a wall, and a box that moves passes it 0.6 m off."""
    stops = ({"time": 0.0, "center": (4.0, 4.5)}, {"time": 10.0, "center": (4.0, -4.0)})
    world = {
        "walls": ({"from": (8.1, -1.0), "to": (8.1, 3.0), "thickness": 0.1},),
        "boxes": ({"center": (1.5, -1.9), "size": (0.8, 0.6)},),
        "moving_boxes": ({"size": (0.4, 0.4), "waypoints": stops},),
    }
    plan = scenario(plant="physics", world=world, estimator={}, operator={"reference": (7.0, 2.0)})
    q = resting(plan).hand_true + np.linspace(-1, 0, 21)[:, None, None] * [6.0, 2.0]
    return run(plan, ticks={"hand_true": q})


def rectangle(middle, size):
    x, y = np.array(middle)[:, None] + np.array(size)[:, None] / 2 * [[-1, 1, 1, -1], [-1, -1, 1, 1]]
    return np.column_stack([x, y, np.full(4, 0.2)])


@pytest.mark.parametrize("camera", ["top", "chase"])
@pytest.mark.parametrize("layers", [frozenset(LAYERS), frozenset(LAYERS) - {"text"}])
def test_things_beside_the_way_are_in_the_picture_and_no_words_cover_them(camera, layers):
    made = among_things()
    task = RenderTask(made, {}, camera, WIDE, layers, made.ticks.time)
    shot, column = camera_path(task, motion_of(made.ticks)), COLUMN * ("text" in layers)
    for k in range(21):
        box = (4.0, 4.5 - 0.85 * TICKS[k])
        away = np.maximum(np.abs(made.ticks.hand_true[k] - box) - 0.2, 0.0)
        corners = rectangle((8.1, 1.0), (0.1, 4.0))
        if TICKS[k] <= 4:  # the chase camera leaves what lies 3 m behind
            corners = np.vstack([corners, rectangle((1.5, -1.9), (0.8, 0.6))])
        if np.linalg.norm(away, axis=1).min() < 2.5:
            corners = np.vstack([corners, rectangle(box, (0.4, 0.4))])
        corners = np.vstack([corners, np.column_stack([made.ticks.hand_true[k], np.zeros(2)])])
        pixels = shot(TICKS[k]).project(corners, WIDE)
        assert np.all((pixels > [column, 0]) & (pixels < WIDE)), (k, pixels)


@pytest.mark.parametrize("camera", ["top", "chase"])
def test_a_wall_that_held_a_robot_is_in_the_picture(camera):
    wall = {"from": (3.65, -2.0), "to": (3.65, 1.0), "thickness": 0.1}
    plan, multipliers = scenario(plant="physics", world={"walls": (wall,)}, estimator={}), np.zeros((21, 2, 2))
    multipliers[-1, 0, 0] = 0.3
    made = run(plan, ticks={"half_space_h": np.full((21, 2, 1), 3.5), "multipliers": multipliers})
    pixels = camera_path(job(camera, made), motion_of(made.ticks))(0.0).project(rectangle((3.65, -0.5), (0.1, 3)), SIZE)
    assert inside(pixels)


def test_the_nearest_eye_sees_all_points_and_some_on_two_opposite_edges():
    points = np.random.default_rng(1).uniform(-1, 1, (30, 3))
    free, size = Viewport(200.0, 20.0, 630.0, 330.0), (640, 360)
    eye = nearest_eye(points, np.eye(3)[[0, 2, 1]], 0.5, size, free)  # looks along y, with z up
    pixels = perspective_camera(eye, eye + np.array([0.0, 1.0, 0.0]), 0.5, 50.0, 0.1).project(points, size)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    slack = np.array([low - free[:2], free[2:] - high])
    assert slack.min() > -1e-9
    assert slack.max(axis=0).min() < 1e-9


def test_from_above_the_area_fills_the_free_part_of_the_picture():
    points = np.array([[0.0, 0.0], [4.0, 1.0]])
    centre, half = top_view(points, (640, 360), Viewport(200.0, 20.0, 600.0, 320.0))
    pixels = top_camera(centre, half, 0.1).project(np.column_stack([points, np.zeros(2)]), (640, 360))
    np.testing.assert_allclose(pixels, [[200.0, 220.0], [600.0, 120.0]], atol=1e-9)


def test_a_camera_that_follows_a_long_way_stays_near_the_team():
    ticks = resting(scenario())
    q = ticks.hand_true + np.linspace(0, 1, 21)[:, None, None] * [28.0, 0.0]
    made = run(ticks={"hand_true": q, "m": q, "reference": q[:, 0]})
    shot = camera_path(job("chase", made), motion_of(made.ticks))
    across = shot(5.0).project(np.column_stack([q[10] + [[0.0, 0.0], [1.0, 0.0]], np.zeros(2)]), SIZE)
    assert np.linalg.norm(across[0] - across[1]) > 30  # pixels between robots


def test_the_robot_camera_follows_its_robot():
    made = moving()
    shot = camera_path(job("robot:2", made), motion_of(made.ticks))
    for k in (0, 10, 20):
        x, y, _ = made.ticks.body_pose_true[k, 1]
        (pixel,) = shot(TICKS[k]).project(np.array([[x, y, 0.02]]), SIZE)
        assert pixel[0] == pytest.approx(320)
        assert 180 < pixel[1] < 360


def test_a_run_that_diverges_still_has_a_picture():
    made = moving()
    made.ticks.hand_true[15:] = 1e200
    made.ticks.hand_true[18:] = np.nan
    camera = camera_path(job("top", made), motion_of(made.ticks))(0.0)
    assert camera.half_height < 50
    assert np.isfinite(camera_path(job("chase", made), motion_of(made.ticks))(9.0).eye).all()


def test_frames_are_evenly_spaced_and_end_before_the_end():
    times = frame_times(TICKS, Clip(fps=10.0, speed=2.0, start=1.0, end=4.0), 240.0)
    np.testing.assert_allclose(times, 1.0 + 0.2 * np.arange(15))
    assert len(frame_times(TICKS, Clip(fps=30.0), 240.0)) == 300
    np.testing.assert_array_equal(frame_times(TICKS[:1], Clip(), 240.0), [0.0])
    np.testing.assert_array_equal(still_time(TICKS, None), [10.0])


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: frame_times(TICKS, Clip(fps=0.0), 240.0), "the fps is 0; allowed: 0.001 to 240"),
        (lambda: frame_times(TICKS, Clip(fps=float("nan")), 240.0), "the fps is nan"),
        (lambda: frame_times(TICKS, Clip(fps=1e-9), 240.0), "the fps is 1e-09; allowed: 0.001 to 240"),
        (lambda: frame_times(TICKS, Clip(fps=60.0), 50.0), "the fps is 60; allowed: 0.001 to 50"),
        (lambda: frame_times(TICKS, Clip(speed=-1.0), 240.0), "the speed is -1"),
        (lambda: frame_times(TICKS, Clip(start=11.0), 240.0), "the time is 11 s; the log has 0 to 10 s"),
        (
            lambda: frame_times(TICKS, Clip(start=5.0, end=4.0), 240.0),
            "the end is 4 s; allowed: from the start, 5 s",
        ),
        (lambda: frame_times(TICKS, Clip(end=float("nan")), 240.0), "the end is nan s"),
        (lambda: still_time(TICKS, -1.0), "the time is -1 s"),
        (lambda: check_camera("robot:3", 2), "no camera 'robot:3'; allowed: top, chase, robot:1 to robot:2"),
        (lambda: check_camera("robot:0", 2), "no camera"),
        (lambda: check_camera("2", 2), "no camera"),
        (lambda: check_size((32, 100)), "the size is 32x100; allowed: 64 to 4096"),
        (lambda: shown_layers(("beam",)), "no layer 'beam' to hide; allowed: beams, half_spaces"),
    ],
)
def test_what_cannot_be_rendered_is_said_in_one_line(call, says):
    with pytest.raises(InputError, match=r"^[^\n]*$") as error:
        call()
    assert says in str(error.value)


def test_layers_are_hidden_by_name():
    assert shown_layers(()) == set(LAYERS)
    assert shown_layers(("beams", "text")) == set(LAYERS) - {"beams", "text"}
    assert shown_layers(("all",)) == set()
