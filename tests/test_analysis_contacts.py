"""Contacts are counted and told apart, and each violates the run unless the scenario allows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.events import events
from pbrg_mj.analysis.metrics.batch_metrics import batch_metrics
from pbrg_mj.analysis.metrics.contacts import FIELDS
from pbrg_mj.analysis.metrics.outcome import outcome
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.scenario.schema.scenario import Contacts
from tests.runs import resting, run, scenario, walled

STEPS = 21  # of 0.5 s
REASONS = {"walls": "touched a wall", "moving": "touched a moving box", "robots": "touched robot 1"}


def flags(*ticks: slice, robot: int = 1) -> np.ndarray:
    found = np.zeros((STEPS, 2), dtype=bool)
    for one in ticks:
        found[one, robot] = True
    return found


@pytest.mark.parametrize("kind", FIELDS)
def test_a_contact_of_any_kind_is_a_violation_unless_allowed(kind):
    touched = {FIELDS[kind]: flags(slice(7, 9)) | (flags(slice(7, 9), robot=0) if kind == "robots" else False)}
    found = outcome(run(walled(), ticks=touched))
    robot = 1 if kind == "robots" else 2
    reason = "touched robot 2" if kind == "robots" else REASONS[kind]
    assert (found.word, found.kind, found.reason, found.robot, found.time) == ("violated", kind, reason, robot, 3.5)
    allowed = walled(outcome={"contacts": {kind: "allowed"}})
    assert outcome(run(allowed, ticks=touched)).word == "converged"
    assert outcome(
        run(walled(outcome={"contacts": dict.fromkeys(set(FIELDS) - {kind}, "allowed")}), ticks=touched)
    ).word == ("violated")


@pytest.mark.parametrize("kind", FIELDS)
def test_contacts_are_counted_by_kind(kind):
    found = metrics(
        run(walled(), ticks={FIELDS[kind]: flags(slice(2, 4), slice(9, 10)) | flags(slice(9, 11), robot=0)})
    )
    for other, field in FIELDS.items():
        expected = (3, pytest.approx(0.5 * 4)) if other == kind else (0, 0.0)
        assert (getattr(found, f"{field}s"), getattr(found, f"{field}_s")) == expected


def test_a_moving_box_s_line_counts_like_a_wall_s():
    margin = np.full((STEPS, 2), 0.3)
    margin[6, 0] = -0.01
    made = run(walled(), ticks={"moving_margin": margin})
    found = outcome(made)
    assert (found.word, found.kind, found.reason, found.robot, found.time) == (
        "violated",
        "moving",
        "passed a moving box's line",
        1,
        3.0,
    )
    assert metrics(made).true_margin_min_m == metrics(made).moving_margin_min_m == -0.01
    allowed = walled(outcome={"contacts": {"moving": "allowed"}})
    assert outcome(replace(made, scenario=allowed)).word == "converged"


def test_a_log_that_is_too_old_does_not_claim_that_there_was_no_contact():
    absent = frozenset({"moving_margin", "moving_contact", "robot_contact"})
    old = run(walled(), ticks={"moving_margin": np.full((STEPS, 2), np.nan)}, absent=absent)
    numbers = metrics(old).as_dict()
    assert (numbers["wall_contacts"], numbers["moving_contacts"], numbers["robot_contacts"]) == (0, None, None)
    assert numbers["robot_contact_s"] is None
    assert numbers["true_margin_min_m"] == 1.0


def test_a_given_half_space_is_no_wall_that_may_be_touched():
    q = resting(scenario()).hand_true.copy()
    q[3, 1] = (2.01, -1.0)
    plan = scenario(outcome={"contacts": dict.fromkeys(FIELDS, "allowed")})
    assert outcome(run(plan, ticks={"hand_true": q})).kind == "half-space"


def test_events_say_who_met_whom():
    pose = resting(walled()).body_pose_true
    met = flags(slice(4, 6)) | flags(slice(4, 6), robot=0)
    told = events(
        run(walled(), ticks={"robot_contact": met, "moving_contact": flags(slice(8, 9)), "body_pose_true": pose})
    )
    assert [(one.time, one.text, one.serious) for one in told] == [
        (2.0, "robot 1 touches robot 2", True),
        (2.0, "robot 2 touches robot 1", True),
        (4.0, "robot 2 touches a moving box", True),
        (10.0, "violated: at 2 s robot 1 touched robot 2", True),
    ]


def test_a_batch_tells_walls_and_robots_apart():
    plan = walled()
    histories = BatchHistories.empty(plan, (1, 2, 3, 4))
    for name in ("hand_world", "m", "wall_margin"):
        getattr(histories, name)[:] = 1.0
    for name in ("wall_contact", "robot_contact", "diverged"):
        getattr(histories, name)[:] = False
    histories.wall_contact[0, 5, 1] = histories.robot_contact[1, 6] = histories.robot_contact[2, 7] = True
    histories.certificate_violated[2, :7, 0] = True
    found = batch_metrics(histories, plan)
    assert found["ball_violated_share"] == {"min": 0.0, "median": 0.0, "max": 7 / len(histories.time)}
    assert found["predictive_violated_share"]["max"] == 0.0
    assert (found["worlds_touching"], found["worlds_touching_robots"], found["worlds_violated"]) == (1, 2, 3)
    for kind, violated in (("robots", 1), ("walls", 2)):
        rules = plan.outcome.model_copy(update={"contacts": Contacts(**{kind: "allowed"})})
        assert batch_metrics(histories, plan.model_copy(update={"outcome": rules}))["worlds_violated"] == violated


TEAM = {
    "start": [[0.0, 0.0], [0.5, 0.0]],
    "formation": [[0.0, 0.0], [0.0, 0.0]],  # both at one place: they must meet
    "leaders": [1],
}


@pytest.mark.parametrize(("rule", "failed"), [("violation", True), ("allowed", False)])
def test_robots_that_bump_fail_a_run_and_a_batch_of_runs(rule, failed):
    plan = {
        "timing": {"duration": 3.0},
        "team": TEAM,
        "sensors": {"beams": {"robots": []}},
        "operator": {"reference": [0.2, 0.0]},
        "outcome": {"contacts": {"robots": rule}},
    }
    made = pbrg.run(pbrg.load(plan))
    assert made.failed is failed
    assert (made.metrics.robot_contacts or 0) >= 2
    assert made.robot_contact.any()
    together = pbrg.batch(pbrg.load(plan), [1, 2])
    assert together.failed is failed
    assert together.summary()["worlds_touching_robots"] == 2


@pytest.mark.parametrize(("rule", "word"), [("violation", "violated"), ("allowed", None)])
def test_a_box_driven_through_the_team_fails_the_run(rule, word):
    """Before, a moving wall pushed through the team gave exit 0."""
    plan = {
        "timing": {"duration": 2.0},
        "team": TEAM | {"formation": [[0.0, 0.0], [0.5, 0.0]]},
        "world": {
            "moving_boxes": [
                {
                    "size": [2.0, 0.1],
                    "waypoints": [{"time": 0.0, "center": [0.2, -0.4]}, {"time": 2.0, "center": [0.2, 0.4]}],
                }
            ]
        },
        "sensors": {"beams": {"robots": []}},
        "operator": {"reference": [0.0, 0.0]},
        "outcome": {"contacts": {"moving": rule}},
    }
    made = pbrg.run(pbrg.load(plan))
    assert made.failed is (word is not None)
    assert (made.metrics.violation_kind == "moving") is (word is not None)
    assert (made.metrics.moving_contacts or 0) >= 2
    assert made.metrics.moving_margin_min_m < 0
