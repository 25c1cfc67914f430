"""Trails: bent at the same times in every frame, and nothing is drawn of robots at rest."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pbrg_mj.video.overlay import TRAIL, TRAIL_STEP, FrameState, Overlay, trail
from pbrg_mj.video.playback import motion_of
from tests.runs import resting, run, scenario


class Lines:
    """A pen that remembers the lines."""

    def __init__(self):
        self.lines = []

    def line(self, start, end, width, colour):
        self.lines.append((start, end, colour))

    def disc(self, *_):
        pass


def drawn(ticks, time):
    made, pen = run(ticks=ticks), Lines()
    overlay = Overlay(made, {}, motion_of(made.ticks), np.ones((2, 4)))
    overlay.draw(pen, FrameState(time, 0, None), frozenset({"trails"}))
    return pen.lines


def moving():
    hand = resting(scenario()).hand_true
    hand[:, 0, 0] = np.linspace(0.0, 2.0, 21)  # robot 1 alone: 0.2 m/s along x
    return {"hand_true": hand}


def test_a_trail_joins_where_the_robot_was_to_where_it_is_and_fades():
    lines = drawn(moving(), 7.3)
    assert len(lines) == np.ceil(7.3 / TRAIL_STEP)
    np.testing.assert_allclose(lines[0][0], [0.0, 0.0, TRAIL], atol=1e-12)
    np.testing.assert_allclose(lines[-1][1], [0.2 * 7.3, 0.0, TRAIL])
    for (_, end, _), (start, _, _) in pairwise(lines):
        np.testing.assert_array_equal(end, start)
    fades = [colour[3] for _, _, colour in lines]
    assert fades == sorted(fades) and 0 < fades[0] < fades[-1] == 0.85


def test_a_trail_is_bent_at_the_same_places_in_every_frame():
    early, late = ([tuple(end) for _, end, _ in drawn(moving(), time)[:-1]] for time in (5.2, 5.4))
    assert early and early == late[: len(early)]


def test_robots_at_rest_leave_no_trail():
    assert drawn({}, 7.3) == []


def test_trails_of_a_run_of_one_tick():
    knots, places = trail(np.array([3.0]), np.array([[[1.0, 2.0]]]))
    assert knots.tolist() == [3.0]
    assert places.tolist() == [[[1.0, 2.0, TRAIL]]]
