from html import escape

import numpy as np
import pytest

from pbrg_mj.analysis.events import events
from pbrg_mj.analysis.metrics.outcome import formation_error, net_speed, outcome
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.metrics.table import comparison_table, short_summary
from pbrg_mj.analysis.replay_summary import replay_summary
from pbrg_mj.analysis.report.report_run import report_run
from pbrg_mj.analysis.report.tables import cards
from tests.runs import resting, run, scenario, walled

STEPS = 21  # of 0.5 s
NOT_CONVEX = "the formation at r meets an obstacle, and what is free beside obstacles is not convex"


def hands(plan, offset):
    """Hand points at the target plus offset (steps, 2)."""
    q = resting(plan).hand_true + np.asarray(offset)[:, None, :]
    return {"hand_true": q}


def still(x):
    return np.tile([x, 0.0], (STEPS, 1))


def moving(speed):
    return np.column_stack([-1.0 + 0.5 * speed * np.arange(STEPS), np.zeros(STEPS)])


def test_a_team_at_its_target_has_converged():
    assert outcome(run()).word == "converged"


def test_the_tolerance_is_the_border_between_converged_and_stuck():
    assert outcome(run(ticks=hands(scenario(), still(-0.0499)))).word == "converged"
    assert outcome(run(ticks=hands(scenario(), still(-0.0501)))).word == "stuck"


def test_converged_means_over_the_whole_window():
    offset = still(0.0)
    offset[-11] = (-0.2, 0.0)  # 5 s before the end, the window's first tick
    assert outcome(run(ticks=hands(scenario(), offset))).word != "converged"
    assert outcome(run(ticks=hands(scenario(), np.roll(offset, -1, axis=0)))).word == "converged"


def test_rest_speed_is_the_border_between_stuck_and_closing_in():
    assert outcome(run(ticks=hands(scenario(), moving(0.00049)))).word == "stuck"
    found = outcome(run(ticks=hands(scenario(), moving(0.0021))))  # from 1 m off, on its way to the target
    assert found.word == "closing in"
    assert found.trend is not None
    assert found.trend.rate == pytest.approx(0.0021)
    assert found.trend.arrival == pytest.approx(10.0 + (1.0 - 0.021 - 0.05) / 0.0021)
    assert found.reason == "at 2.1 mm/s, there at 452.4 s at this speed"


def test_the_way_to_where_a_team_rests_is_no_hunting():
    """It comes 2 m nearer in the first 3 s of the 10 s, and then rests 1 m off, or moves to and fro by 8 mm."""
    way = still(-1.0)
    way[:6, 0] = np.linspace(-3.0, -1.0, 6)
    assert outcome(run(ticks=hands(scenario(), way))).reason == "1 m short"
    way[10:, 1] = np.where(np.arange(11) % 2, 0.004, -0.004)
    way[10, 1] = way[-1, 1] = 0.0
    assert outcome(run(ticks=hands(scenario(), way))).reason.startswith("1 m short, hunting within 4")


@pytest.mark.parametrize(
    ("limit", "expected"),
    [(0.3, "extrapolated to level off 0.3 m short"), (0.0, "extrapolated to arrive at 29.96 s")],
)
def test_an_exponential_approach_is_told_to_be_extrapolated(limit, expected):
    t, tau = 0.5 * np.arange(STEPS), 5.0
    offset = np.column_stack([-limit - 20.0 * np.exp(-t / tau), 0 * t])
    reason = outcome(run(ticks=hands(scenario(), offset))).reason
    assert reason is not None
    assert reason.split(" mm/s, ")[1] == expected


def test_who_arrives_just_before_the_end_is_told_to_be_there():
    x = np.full(STEPS, 0.04)
    x[:14] = 0.04 + 0.2 * (13 - np.arange(14))
    found = outcome(run(ticks=hands(scenario(), np.column_stack([-x - 0.005 * np.arange(STEPS)[::-1], 0 * x]))))
    assert (found.word, found.reason) == ("closing in", "there for less than 5 s")


def test_one_robot_still_moving_is_not_stuck():
    q = resting(scenario()).hand_true - (0.3, 0.0)
    q[:, 1] += moving(0.1)
    assert outcome(run(ticks={"hand_true": q})).word == "closing in"


def test_speed_is_net_not_along_the_path():
    hand = np.zeros((5, 1, 2))
    hand[1::2, 0, 0] = 1.0
    assert net_speed(hand, np.arange(5.0)) == pytest.approx([0.0])
    hand[-1, 0] = (3.0, 4.0)
    assert net_speed(hand, np.arange(5.0)) == pytest.approx([1.25])


def test_a_contact_is_a_violation_with_robot_and_time():
    contact = np.zeros((STEPS, 2), dtype=bool)
    contact[7:, 1] = True
    found = outcome(run(walled(), ticks={"wall_contact": contact}))
    assert (found.word, found.reason, found.robot, found.time) == ("violated", "touched a wall", 2, 3.5)


def test_a_margin_below_zero_is_a_violation():
    margin = np.ones((STEPS, 2))
    margin[4, 0] = -1e-3
    found = outcome(run(walled(), ticks={"wall_margin": margin}))
    assert (found.word, found.reason, found.robot, found.time) == ("violated", "passed a wall's line", 1, 2.0)
    assert outcome(run(walled(), ticks={"wall_margin": np.maximum(margin, 0.0)})).word == "converged"


def test_robot_and_time_of_a_violation_are_told_wherever_people_read():
    margin = np.ones((STEPS, 2))
    margin[4:, 1] = -1e-3
    violated, said = run(walled(), ticks={"wall_margin": margin}), "at 2 s robot 2 passed a wall's line"
    numbers = metrics(violated)
    assert numbers.reason == "passed a wall's line"
    assert said in short_summary(numbers)
    assert said in " ".join(comparison_table([numbers]).split())
    *_, last = replay_summary(violated).lines()
    assert last == f"outcome violated ({said})"
    assert events(violated)[-1].text == f"violated: {said}"
    assert f"<small>{escape(said)}</small>" in cards([report_run(violated, 1)])


def test_the_first_of_contact_and_line_is_told():
    margin, contact = np.ones((STEPS, 2)), np.zeros((STEPS, 2), dtype=bool)
    margin[4:, 0] = -1e-3
    contact[6, 0] = True
    found = outcome(run(walled(), ticks={"wall_margin": margin, "wall_contact": contact}))
    assert (found.reason, found.time) == ("passed a wall's line", 2.0)
    contact[3, 1] = True
    found = outcome(run(walled(), ticks={"wall_margin": margin, "wall_contact": contact}))
    assert (found.reason, found.robot, found.time) == ("touched a wall", 2, 1.5)


def test_without_walls_the_given_half_space_counts():
    q = resting(scenario()).hand_true.copy()
    q[3, 1] = (2.01, -1.0)
    found = outcome(run(ticks={"hand_true": q, "wall_margin": np.full((STEPS, 2), np.inf)}))
    assert (found.word, found.reason, found.robot, found.time) == ("violated", "passed a given half-space", 2, 1.5)


@pytest.mark.parametrize("name", ["p", "xi", "m"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1003.1, -1003.1])
def test_states_and_references_may_diverge(name, value):
    """Beyond the largest r, 3 m here, by more than 1000 m."""
    values = getattr(resting(scenario()), name).copy()
    values[9, 1, 0] = value
    assert outcome(run(scenario(operator={"reference": [2.0, -3.0]}), ticks={name: values})).word == "diverged"


def test_who_follows_a_reference_far_away_has_not_diverged():
    far = scenario(operator={"reference": [1e6, 0.0]}, estimator={"source": "given"})
    assert outcome(run(far)).word == "converged"
    waypoints = [{"time": 0, "reference": [1.0, 0.0]}, {"time": 1, "reference": [3.0, -1e4]}]
    assert scenario(operator={"waypoints": waypoints}).divergence_limit == 1e4 + 1000.0


def test_violated_beats_diverged():
    contact = np.ones((STEPS, 2), dtype=bool)
    m = np.full((STEPS, 2, 2), np.nan)
    assert outcome(run(walled(), ticks={"wall_contact": contact, "m": m})).word == "violated"


def test_a_run_shorter_than_the_window_is_unfinished():
    plan = scenario(outcome={"rest_time": 10.5})
    found = outcome(run(plan))
    assert (found.word, found.reason) == ("unfinished", "shorter than 10.5 s")
    assert outcome(run(scenario(outcome={"rest_time": 10.0}))).word == "converged"


def test_without_an_admissible_formation_a_team_at_rest_is_stuck():
    given = (
        {"robot": 1, "normal": (0.0, 1.0), "offset": 0.0},
        {"robot": 1, "normal": (0.0, -1.0), "offset": 0.5},  # y >= -0.5: too narrow for b_2 = (0, -1)
    )
    plan = scenario(estimator={"source": "given", "given": given})
    found = outcome(run(plan, ticks={"hand_true": np.zeros((STEPS, 2, 2))}))
    assert (found.word, found.reason) == ("stuck", "1.4 m short; no admissible formation")


def test_a_moving_team_without_target_is_measured_from_r_and_says_why():
    box = {"center": (1.0, 0.0), "size": (0.5, 0.5)}
    plan = scenario(plant="physics", world={"boxes": (box,)}, estimator={"scope": "own"})
    away = (3.0, 0.0) + np.zeros((STEPS, 2, 2)) + moving(0.1)[:, None] + np.array(plan.team.formation)
    found = outcome(run(plan, ticks={"hand_true": away}))
    assert found.word == "receding"
    assert found.reason is not None
    assert found.reason.startswith("at 100 mm/s, 2 m short; the formation at r meets an obstacle")


@pytest.mark.parametrize(("off", "told"), [(0.0499, ", at the governed m; "), (0.0501, "; ")])
def test_before_a_wall_a_team_at_its_governed_reference_says_so(off, told):
    box = {"center": (1.0, 0.0), "size": (0.5, 0.5)}
    plan = scenario(plant="physics", world={"boxes": (box,)}, estimator={"scope": "own"})
    q = np.full((STEPS, 2, 2), (-1.0, 0.0)) + np.array(plan.team.formation)
    m = np.full((STEPS, 2, 2), (-1.0 - off, 0.0))
    found = outcome(run(plan, ticks={"hand_true": q, "m": m}))
    assert (found.word, found.reason) == ("stuck", f"2 m short{told}{NOT_CONVEX}")


def test_the_trend_begins_with_the_last_reference():
    r = np.tile([1.0, 0.0], (STEPS, 1))
    r[:8] = (1.0, 5.0)  # until then the team stood still
    q = resting(scenario()).hand_true.copy()
    q[8:, :, 0] -= 0.9 - 0.05 * np.arange(STEPS - 8)[:, None]
    q[:8, :, 0] -= 0.9
    assert outcome(run(ticks={"hand_true": q, "reference": r})).word == "closing in"
    r[:12] = (1.0, 5.0)
    found = outcome(run(ticks={"hand_true": q, "reference": r}))
    assert (found.word, found.reason) == ("unfinished", "the reference changed 4 s before the end")


def test_boxes_are_walls_to_the_margin():
    plan = scenario(plant="physics", world={"boxes": ({"center": (5.0, 0.0), "size": (0.5, 0.5)},)}, estimator={})
    margin = np.ones((STEPS, 2))
    margin[4, 0] = -1e-3
    assert outcome(run(plan, ticks={"wall_margin": margin})).word == "violated"


def test_the_formation_error_is_the_worst_robot_s():
    q = resting(scenario()).hand_true.copy()
    q[-1, 0] += (3.0, 4.0)
    error = formation_error(run(ticks={"hand_true": q}), np.array([1.0, 0.0]))
    assert error[-1] == pytest.approx(5.0)
    assert error[0] == 0.0
