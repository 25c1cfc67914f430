"""What figures and videos show of the plane: what held robots always, near things whole, far ones not."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.area_of_interest import area_of_interest, points_of_interest
from pbrg_mj.analysis.metrics.multiplier_rows import binding_area
from tests.runs import resting, run, scenario

NOTHING = np.zeros((0, 2))


def among(world, **ticks):
    """A team at rest at (1, 0) and (1, -1) that started a metre to the left; beside = 1 m."""
    return run(scenario(plant="physics", world=world, estimator={}), ticks=ticks)


def wall(x):
    """A wall a metre long whose face is at x."""
    return {"walls": ({"from": (x + 0.05, -1.0), "to": (x + 0.05, 0.0), "thickness": 0.1},)}


def holding(x, multiplier):
    """Columns of a half-space of robot 1's, for all robots, whose multiplier is positive at the fifth tick alone."""
    h, multipliers = np.zeros((21, 2, 1)), np.zeros((21, 2, 2))
    h[:, 0], multipliers[4, 0, 1] = x, multiplier
    return {"half_space_h": h, "multipliers": multipliers}


@pytest.mark.parametrize(("multiplier", "shown"), [(0.1, True), (1e-6, False)])
def test_a_half_space_that_held_a_robot_is_shown_with_its_wall_and_another_as_far_is_not(multiplier, shown):
    made = among(wall(3.1), **holding(3.0, multiplier))
    _, high = area_of_interest(made, NOTHING)
    assert high[0] == pytest.approx(3.2 if shown else 1.0)


def test_the_point_at_which_a_line_holds_is_that_of_the_nearest_robot_it_binds():
    ticks = holding(3.0, 0.1)
    G = resting(scenario()).half_space_G.copy()
    G[:, 0, 0] = (0.6, 0.8)
    areas = binding_area(run(ticks=ticks | {"half_space_G": G}).ticks, scenario())
    nearest = np.array([1.0, 0.0]) + (3.0 - 0.6) * np.array([0.6, 0.8])  # of robot 1, at (1, 0)
    np.testing.assert_allclose(areas[4], [nearest, nearest])
    assert np.all(areas[[3, 5], 0] == np.inf) and np.all(areas[[3, 5], 1] == -np.inf)


def test_a_line_that_a_robot_is_beyond_holds_where_the_robot_is():
    areas = binding_area(run(ticks=holding(0.25, 0.1)).ticks, scenario())
    np.testing.assert_allclose(areas[4], [[1.0, 0.0], [1.0, 0.0]])


@pytest.mark.parametrize(("x", "shown"), [(1.9, True), (2.1, False)])
def test_things_are_near_within_a_metre_of_a_short_way_and_then_shown_whole(x, shown):
    _, high = area_of_interest(among(wall(x)), NOTHING)
    assert high[0] == pytest.approx(x + 0.1 if shown else 1.0)


@pytest.mark.parametrize(("x", "shown"), [(7.7, True), (7.8, False)])
def test_of_a_long_way_half_its_length_is_near(x, shown):
    """The way is 5.5 m long: 2.75 m beyond its end are near."""
    goal = np.array([[5.0, 0.0], [-0.5, 0.0]])
    _, high = area_of_interest(among(wall(x)), goal)
    assert high[0] == pytest.approx(x + 0.1 if shown else 5.0)


def test_of_a_long_wall_a_metre_past_the_way_is_shown():
    long = {"walls": ({"from": (1.5, -50.0), "to": (1.5, 50.0), "thickness": 0.1},)}
    low, high = area_of_interest(among(long), NOTHING)
    np.testing.assert_allclose([low, high], [[0.0, -2.0], [1.55, 1.0]])


@pytest.mark.parametrize(("x", "near"), [(1.5, True), (2.5, False)])
def test_a_moving_box_that_comes_near_is_shown_whole_within_three_metres_of_a_robot(x, near):
    """It comes down at 2 m/s; at the ticks its middle is at whole y, from 3 to -4 less than 3 m off a robot."""
    stops = ({"time": 0.0, "center": (x, 10.0)}, {"time": 10.0, "center": (x, -10.0)})
    made = among({"moving_boxes": ({"size": (0.4, 0.4), "waypoints": stops},)})
    low, high = area_of_interest(made, NOTHING)
    np.testing.assert_allclose([low, high], [[0.0, -4.2], [1.7, 3.2]] if near else [[0.0, -1.0], [1.0, 0.0]])


def test_of_a_slanting_wall_the_part_near_the_way_is_shown_and_no_corner_of_its_box():
    """It runs along x + y = 2 from (-50, 52): within a metre of the way, from (0.0, 2.0) at the upper to (2.0, 0.0)."""
    slanting = {"walls": ({"from": (-50.0, 52.0), "to": (52.0, -50.0), "thickness": 1e-3},)}
    shown = points_of_interest(among(slanting), NOTHING)
    on_wall = shown[shown.sum(axis=1) > 1.9]
    np.testing.assert_allclose(on_wall.sum(axis=1), 2.0, atol=1e-3)
    np.testing.assert_allclose(on_wall.max(axis=0), [2.0, 1.0], atol=1e-3)


def test_what_diverges_or_is_too_far_is_left_out():
    made = among({}, **holding(1e6, 0.1))
    made.ticks.hand_true[15:] = 1e200
    made.ticks.hand_true[18:] = np.nan
    low, high = area_of_interest(made, np.array([[np.nan, 0.0]]))
    np.testing.assert_allclose([low, high], [[0.0, -1.0], [1.0, 0.0]])
