"""What binds at the end, from planted multipliers, contacts, voltages and wheel speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.analysis.events import episodes, events
from pbrg_mj.analysis.metrics.binding import bindings, half_space_text
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.metrics.table import comparison_table, short_summary
from pbrg_mj.world.scene.robot import load_robot_model
from tests.runs import WALL, resting, run, scenario, walled

STEPS = 21  # of 0.5 s
ROBOT = load_robot_model()
BREAKAWAY = ROBOT.static_torque / ROBOT.stall_torque * ROBOT.voltage  # [V]


def kinds(made) -> list[str]:
    return [one.kind for one in bindings(made)]


def texts(made) -> list[str]:
    return [one.text for one in bindings(made)]


def multipliers(*rows: tuple[int, int, float]) -> np.ndarray:
    """Multipliers (T, 2, 2) by owner and robot held back."""
    found = np.zeros((STEPS, 2, 2))
    for owner, held, value in rows:
        found[:, owner, held] = value
    return found


def sensed(h: float = 2.1) -> dict:
    """Both robots hold x <= h."""
    G = np.zeros((STEPS, 2, 1, 2))
    G[..., 0] = 1.0
    active = np.ones((STEPS, 2, 1), dtype=bool)
    return {"half_space_G": G, "half_space_h": np.full((STEPS, 2, 1), h), "half_space_active": active}


def test_a_team_where_r_wants_it_is_bound_by_nothing():
    assert bindings(run()) == ()
    assert "binds at the end" in short_summary(metrics(run()))


def test_a_half_space_with_owner_obstacle_and_whom_it_holds():
    made = run(walled(), ticks={"multipliers": multipliers((0, 1, 3.1)), **sensed()})
    assert texts(made) == ["robot 1's half-space x <= 2.1 (walls.0), holding robot 2, lambda 3.1"]
    assert metrics(made).binding == tuple(texts(made))
    own = run(walled(), ticks={"multipliers": multipliers((1, 1, 0.42)), **sensed()})
    assert texts(own) == ["robot 2's half-space x <= 2.1 (walls.0), lambda 0.42"]


def test_large_numbers_have_no_exponents():
    made = run(walled(), ticks={"multipliers": multipliers((0, 1, 310.0)), **sensed(12345.0)})
    assert "robot 1's half-space x <= 12300, holding robot 2, lambda 310" in texts(made)
    far = np.full((STEPS, 2, 2), 1500.0)
    told = texts(run(walled(), ticks={"multipliers": multipliers((0, 1, 310.0)), "xi": far, **sensed()}))
    assert "the ball holds m 3000 m off it (robots' distances from m 0, integral states 3000)" in told
    numbers = replace(metrics(made), terminal_gap_m=12345.6)
    assert "12350" in short_summary(numbers) and "e+" not in comparison_table([numbers])


def test_a_line_that_several_see_is_one_and_small_multipliers_are_left_out():
    both = run(walled(), ticks={"multipliers": multipliers((0, 1, 0.3), (1, 1, 0.1)), **sensed()})
    assert texts(both) == ["half-space of robots 1, 2: x <= 2.1 (walls.0), holding robot 2, lambda 0.4"]
    one = run(walled(), ticks={"multipliers": multipliers((0, 1, 3.0), (1, 1, 0.1)), **sensed()})
    assert texts(one) == ["robot 1's half-space x <= 2.1 (walls.0), holding robot 2, lambda 3"]
    assert bindings(run(walled(), ticks={"multipliers": multipliers((0, 1, 5e-4)), **sensed()})) == ()


def test_the_nearest_of_two_posts_is_named():
    """Both posts have the same face; robot 1 at (1, 0) sees the one beside it."""
    posts = ({**WALL, "from": (2.25, 3.0)}, {**WALL, "to": (2.25, 1.0)})
    made = run(scenario(plant="physics", world={"walls": posts}, estimator={}))
    made = replace(made, ticks=replace(made.ticks, multipliers=multipliers((0, 0, 1.0)), **sensed()))
    assert "(walls.1)" in texts(made)[0]
    far = replace(made, ticks=replace(made.ticks, half_space_h=np.full((STEPS, 2, 1), 1.5)))
    assert texts(far) == ["robot 1's half-space x <= 1.5, lambda 1"]  # on no obstacle's face


def test_a_given_half_space_and_the_cap():
    made = run(scenario(governor={"multiplier_cap": 5.0}), ticks={"multipliers": multipliers((0, 0, 5.0))})
    assert texts(made) == ["multipliers of robot 1 at their cap 5", "robot 1's half-space x <= 2 (given), lambda 5"]


def test_the_ball_is_named_with_its_parts():
    xi = np.zeros((STEPS, 2, 2))
    xi[:, 1] = (0.3, 0.4)
    made = run(
        walled(),
        ticks={"multipliers": multipliers((0, 0, 1.0)), "xi": xi, "p": np.ones((STEPS, 2, 2)) * (1, 0), **sensed()},
    )
    assert texts(made)[1] == "the ball holds m 0.5 m off it (robots' distances from m 0, integral states 0.5)"


def test_input_rows_are_named_by_robot_and_limit():
    plan = walled(control={"speed_limit": 0.8})
    found = np.zeros((STEPS, 2, 2 + 1))
    found[:, 1, 2] = 0.7
    assert texts(run(plan, ticks={"multipliers": found, **sensed()})) == ["robot 2's input rows, 0.8 m/s, lambda 0.7"]


def test_rows_of_a_predicted_motion_are_two_for_each_half_space():
    plan = walled(governor={"kind": "centralized", "certificate": "predictive"})
    made = run(plan, ticks={"multipliers": multipliers((1, 0, 0.6)), **sensed()})
    assert texts(made) == ["robot 2's half-space x <= 2.1 (walls.0), lambda 0.6"]


def test_the_governor_s_status_and_the_network_s_lag():
    status = np.array(["ok"] * (STEPS - 1) + ["infeasible"])
    assert texts(run(ticks={"status": status})) == ["governor infeasible"]
    made = run()
    late = replace(made, optima=replace(made.optima, m=made.optima.m + np.array([0.3, 0.4])))
    assert texts(late) == ["the leaders' m is 0.5 m from the optimum m*"]
    nobody = replace(late, scenario=scenario(governor={"kind": "none"}))
    assert bindings(nobody) == ()


def test_without_multipliers_of_its_own_those_of_the_optimum_count_where_m_is_there():
    made = run()
    found = np.zeros_like(made.optima.multipliers)
    found[:, 0, 1] = 0.2
    optimum = replace(made.optima, multipliers=found)
    assert kinds(replace(made, optima=optimum)) == ["half-space"]
    elsewhere = replace(optimum, m=made.optima.m + np.array([0.3, 0.4]))
    assert kinds(replace(made, optima=elsewhere)) == ["network"]


@pytest.mark.parametrize(("share", "speed", "expected"), [(0.9, 0.0, True), (1.1, 0.0, False), (0.9, 0.5, False)])
def test_static_friction_is_wheels_that_stand_below_breakaway(share, speed, expected):
    q = resting(walled()).hand_true.copy()
    q[:, 1, 0] -= 0.04  # robot 2 is short of m
    ticks = {
        "hand_true": q,
        "command": np.full((STEPS, 2, 2), share * BREAKAWAY),
        "wheel_speed": np.full((STEPS, 2, 2), speed),
    }
    found = texts(run(walled(), ticks=ticks))
    told = f"static friction: wheels of robot 2 below breakaway, {share * BREAKAWAY:.2g} of {BREAKAWAY:.2g} V"
    assert found == ([told] if expected else [])
    assert bindings(run(walled(drive={"kind": "speed_loop"}), ticks=ticks)) == ()
    assert bindings(run(ticks=ticks)) == ()  # the ideal plant has no wheels


def test_motors_at_their_limit_and_dead_ones():
    q = resting(walled()).hand_true.copy()
    q[:, :, 0] -= 0.4
    ticks = {"hand_true": q, "command": np.full((STEPS, 2, 2), -6.0)}
    assert texts(run(walled(), ticks=ticks)) == ["motors of robots 1, 2 at their limit of 6 V"]
    dead = walled(disturbances={"dead_motors": ({"robot": 1, "side": "left", "time": 3.0},)})
    assert texts(run(dead, ticks=ticks)) == ["robot 1's left motor is dead", "motors of robot 2 at their limit of 6 V"]


def test_contacts_at_the_end_bind_and_earlier_ones_do_not():
    touched = np.zeros((STEPS, 2), dtype=bool)
    touched[:5] = True
    assert bindings(run(walled(), ticks={"robot_contact": touched})) == ()
    touched[-2] = True
    assert texts(run(walled(), ticks={"robot_contact": touched})) == ["robots 1, 2 in contact with each other"]


@pytest.mark.parametrize(
    ("G", "h", "text"),
    [
        ((1, 0), 1.8, "x <= 1.8"),
        ((-1, 0), 0.16, "x >= -0.16"),
        ((0, -1), -0.5, "y >= 0.5"),
        ((np.sqrt(0.5), -np.sqrt(0.5)), 2.1213, "0.71 x - 0.71 y <= 2.12"),
    ],
)
def test_half_spaces_are_written_as_one_writes_them(G, h, text):
    assert half_space_text(np.array(G), h) == text


def test_sentences_have_as_many_lines_as_they_need():
    made = metrics(run(walled(), ticks={"multipliers": multipliers((0, 1, 3.1)), **sensed()}))
    lines = comparison_table([made, metrics(run())]).splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("  binds at the end"))
    assert " ".join(" ".join(line[40:69] for line in lines[first : first + 3]).split()) == made.binding[0]
    assert lines[first][71:].strip() == "-"
    assert max(map(len, lines[first : first + 3])) <= 100


def test_the_last_events_say_how_it_ended_and_what_binds():
    made = run(walled(), ticks={"multipliers": multipliers((0, 1, 3.1)), **sensed()})
    told = [(one.time, one.text) for one in events(made)]
    assert told == [(10.0, "converged"), (10.0, f"binds: {texts(made)[0]}")]


def test_wind_up_of_single_ticks_is_no_event():
    """Two robots on a path: lambda_2 = 2, so the detector remembers 0.5 s."""
    winding = np.zeros((STEPS, 2), dtype=bool)
    winding[[3, 5, 7, 9], 0] = True  # 0.5 s up, 1 s from onset to onset
    winding[4:9, 1] = True
    told = [one.text for one in events(run(walled(), ticks={"winding_up": winding}))]
    assert told == ["robot 2: integrator wind-up for 2 s", "converged"]


def test_episodes_bridge_short_pauses_and_leave_out_short_ones():
    time = 0.01 * np.arange(1000)
    flag = np.zeros(1000, dtype=bool)
    flag[100:400:2] = True  # every second tick
    flag[600] = flag[950:960] = True
    assert episodes(flag, time, 0.7) == [(100, 398)]
    assert episodes(np.zeros(5, dtype=bool), time[:5], 0.7) == []
