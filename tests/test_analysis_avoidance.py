"""Contacts with moving boxes that a robot could have avoided, against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.avoidance import MovingContactTotals, with_avoidance
from pbrg_mj.analysis.metrics.outcome import outcome
from pbrg_mj.analysis.metrics.reachable import STEP, can_escape, is_visible, top_speed
from pbrg_mj.analysis.metrics.run_metrics import metrics
from tests.runs import run, scenario

BODY = 0.06  # [m] of the generic robot
TIMES = STEP * np.arange(61)
HAND = np.zeros(2)


def coming(speed: float, half_width: float, ahead: float, **world: object):
    """A box whose face is `ahead` of the hand point and comes at it."""
    first, way = [ahead + 0.1, 0.0], speed * TIMES[-1]
    stops = [{"time": 0.0, "center": first}, {"time": TIMES[-1], "center": [first[0] - way, 0.0]}]
    return scenario(world={"moving_boxes": [{"size": [0.2, 2 * half_width], "waypoints": stops}], **world})


@pytest.mark.parametrize("speed", [2.0, 3.0])
@pytest.mark.parametrize("ahead", [0.4, 0.6])
def test_who_escapes_a_faster_box_is_told_by_the_closed_form(speed, ahead):
    """A point passes the end of a front of half width w, `ahead` of it, if w <= v ahead / sqrt(V^2 - v^2).

    The other way round the set is rounded outwards, by up to half of the width here.
    """
    own = top_speed(coming(speed, 0.1, ahead))
    widest = own * ahead / math.sqrt(speed**2 - own**2)
    for half_width, escapes in ((widest - BODY, True), (1.5 * widest + BODY, False)):
        plan = coming(speed, half_width, ahead)
        assert can_escape(plan, plan.world.moving_boxes[0], TIMES, HAND) is escapes


def test_nobody_is_caught_by_a_slower_box_in_the_open():
    plan = coming(0.9 * top_speed(coming(1.0, 0.1, 1.0)), 0.7, 0.3)
    assert can_escape(plan, plan.world.moving_boxes[0], TIMES, HAND)


def walls_of_a_blind_alley(width: float, depth: float) -> list[dict[str, list[float]]]:
    left = [[1.0, width / 2], [-depth, width / 2], [-depth, -width / 2], [1.0, -width / 2]]
    return [{"from": start, "to": end} for start, end in pairwise(left)]


def test_no_motion_avoids_a_slow_box_that_fills_a_blind_alley():
    for half_width, escapes in ((0.2, False), (0.05, True)):
        plan = coming(0.1, half_width, 0.3, walls=walls_of_a_blind_alley(0.5, 0.2))
        assert can_escape(plan, plan.world.moving_boxes[0], STEP * np.arange(81), HAND) is escapes


def test_a_box_behind_a_wall_is_out_of_sight():
    wall = {"from": [0.5, -0.6], "to": [0.5, 0.6]}
    for walls, seen in (([], True), ([wall], False), ([{**wall, "to": [0.5, 0.0]}], True)):
        plan = coming(0.1, 0.2, 1.0, walls=walls)
        assert is_visible(plan, plan.world.moving_boxes[0], 0.0, HAND) is seen
    plan = coming(0.1, 0.2, 5.0)
    assert not is_visible(plan, plan.world.moving_boxes[0], 0.0, HAND)


def touched(plan, at: int, place: tuple[float, float]):
    """A run of 21 ticks of 0.5 s in which robot 2 stands at a place and touches a box from a tick on."""
    flags = np.zeros((21, 2), dtype=bool)
    flags[at:, 1] = True
    made = run(plan)
    q = made.ticks.hand_true.copy()
    q[:, 1] = place
    return run(plan, ticks={"moving_contact": flags, "hand_true": q})


def test_metrics_and_outcome_tell_them_apart():
    slow, fast = coming(0.1, 0.2, 0.5), coming(3.0, 2.5, 0.5)
    could, could_not = touched(slow, 10, (0.0, 0.0)), touched(fast, 1, (0.0, 0.0))
    assert (metrics(could).moving_contacts, metrics(could).moving_contacts_avoidable) == (1, 1)
    assert metrics(could).reason == outcome(could).reason == "touched a moving box"
    assert (metrics(could_not).moving_contacts, metrics(could_not).moving_contacts_avoidable) == (1, 0)
    assert metrics(could_not).reason == "touched a moving box that no motion avoids"


def test_a_run_in_parts_is_judged_like_the_whole():
    made = touched(coming(0.1, 0.2, 0.5), 10, (0.0, 0.0))
    whole, parts = MovingContactTotals(made.scenario), MovingContactTotals(made.scenario)
    whole.add(made.ticks)
    for first in range(0, 21, 4):
        parts.add(made.ticks.rows(first, first + 4))
    assert whole.first_contacts() == parts.first_contacts() != []
    assert with_avoidance(outcome(made), parts.first_contacts()) == outcome(made)


def test_worlds_of_a_batch_are_told_apart():
    stops = [{"time": 0.0, "center": [0.8, -0.1]}, {"time": 0.5, "center": [-0.8, -0.1]}]
    plan = {
        "timing": {"duration": 0.5},
        "team": {"start": [[0.0, 0.0], [0.0, -0.4]], "formation": [[0.0, 0.0], [0.0, -0.4]], "leaders": [1]},
        "operator": {"reference": [0.0, 0.0]},
        "governor": {"kind": "certified"},
        "world": {"moving_boxes": [{"size": [0.2, 3.0], "waypoints": stops}]},
    }
    found = pbrg.batch(pbrg.load(plan), [1])
    assert found["world_touching_moving"].tolist() == [True]
    assert found["world_touching_moving_avoidably"].tolist() == [False]
