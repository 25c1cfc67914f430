import json

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.margins import ball_radius, sensed_margin, true_margin
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.analysis.metrics.samples import Statistics, statistics
from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.evaluate import worst_rows
from pbrg_mj.governor.problem.ball import ball_rows
from pbrg_mj.governor.problem.rows import rho, row_values
from pbrg_mj.perception.half_spaces import HalfSpaces
from tests.runs import optima, replaced, resting, run, scenario, timings, walled

STEPS = 21
SOLVED = np.arange(0, STEPS, 4)


def shifted_references(shift):
    """Governed references m = r + shift, shift (2 robots, 2), at every tick."""
    return {"m": resting(scenario()).m + np.asarray(shift)}


def random_ticks(seed, steps=7, n=3, slots=2):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, (steps, n, slots))
    plan = scenario(team={"start": ((0.0, 0.0),) * n, "formation": ((0.0, 0.0),) * n, "leaders": (1,)})
    states = {name: rng.normal(size=(steps, n, 2)) for name in ("m", "p", "xi", "hand")}
    half_spaces = {
        "half_space_G": np.stack([np.cos(angle), np.sin(angle)], axis=-1),
        "half_space_h": rng.normal(size=(steps, n, slots)),
    }
    active = rng.random((steps, n, slots)) < 0.6
    binds = active[..., None] & (rng.random((steps, n, slots, n)) < 0.7)
    half_spaces |= {"half_space_active": active, "half_space_binds": binds}
    return replaced(resting(plan, steps), **states, **half_spaces), rng.normal(size=(n, 2))


@pytest.mark.parametrize("seed", range(5))
def test_certificate_rows_are_the_governor_s_own(seed):
    ticks, formation = random_ticks(seed)
    leaders = np.array([0, 2])
    arrays = ticks.half_space_G, ticks.half_space_h, ticks.half_space_active, ticks.half_space_binds
    expected = []
    for t in range(7):
        rows = ball_rows(HalfSpaces(*(array[t] for array in arrays)), formation)
        expected.append(max(row_values(rows, ticks.m[t, i], ticks.p[t], ticks.xi[t]).max() for i in leaders))
    states = ticks.p, ticks.xi, ticks.m[:, leaders]
    found = worst_rows(HalfSpaces(*arrays), states, formation, np.empty((3, 0, 6)))
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-12)
    assert np.isnan(found[:, 2]).all()  # no prediction to look at
    radius = [rho(m, p, xi) for m, p, xi in zip(ticks.m[:, 0], ticks.p, ticks.xi, strict=True)]
    np.testing.assert_allclose(ball_radius(ticks.m[:, 0], ticks.p, ticks.xi), radius, rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_sensed_margin_is_the_least_over_all_pairs(seed):
    ticks, _ = random_ticks(seed)
    for t, found in enumerate(sensed_margin(ticks)):
        pairs = np.argwhere(ticks.half_space_binds[t])
        margins = [ticks.half_space_h[t, i, k] - ticks.half_space_G[t, i, k] @ ticks.hand[t, j] for i, k, j in pairs]
        assert found == pytest.approx(min(margins), rel=1e-12)


def test_without_half_spaces_there_is_no_row_and_no_margin():
    nothing = np.zeros((STEPS, 2, 1), dtype=bool)
    ticks = {
        "half_space_active": nothing,
        "half_space_binds": np.zeros((STEPS, 2, 1, 2), dtype=bool),
        "wall_margin": np.full((STEPS, 2), np.inf),
    }
    found = metrics(run(scenario(estimator={"source": "given"}), ticks=ticks)).as_dict()
    assert found["certificate_worst_m"] is None
    assert found["certificate_violated_share"] == 0.0
    assert found["sensed_margin_min_m"] is None
    assert found["true_margin_min_m"] is None


def test_the_resting_run():
    """At rest at r = m = m* = (1, 0), rho = 0, one metre before the line x = 2."""
    found = metrics(run())
    nothing = Statistics(0.0, 0.0, 0.0)
    assert (found.outcome, found.duration_s, found.ticks, found.robots) == ("converged", 10.0, 21, 2)
    assert (found.target_x_m, found.target_y_m, found.terminal_gap_m, found.settling_time_s) == (1.0, 0.0, 0.0, 0.0)
    assert (found.true_margin_min_m, found.sensed_margin_min_m, found.certificate_worst_m) == (1.0, 1.0, -1.0)
    assert found.optimality_gap_m == found.cost_gap_m2 == found.consensus_spread_m == nothing


def test_the_certificate_s_worst_row_and_share_of_time():
    """rho = sqrt(2) * 0.9 with xi off by 0.9 for both robots: g = rho + 1 - 2 > 0 in 7 of 21 ticks."""
    xi = np.zeros((STEPS, 2, 2))
    xi[:7, :, 1] = 0.9
    found = metrics(run(ticks={"xi": xi}))
    assert found.certificate_worst_m == pytest.approx(0.9 * np.sqrt(2) - 1.0)
    assert found.certificate_violated_share == pytest.approx(1 / 3)


def test_only_the_leaders_references_are_certified():
    """Robot 1 follows: its m may lie beyond the line."""
    assert metrics(run(ticks=shifted_references([[5.0, 0.0], [0.0, 0.0]]))).certificate_worst_m == -1.0
    m_leader = metrics(run(ticks=shifted_references([[0.0, 0.0], [3.0, 0.0]]))).certificate_worst_m
    assert m_leader == pytest.approx(3.0 * np.sqrt(2) + 4.0 - 2.0)


def test_the_optimality_gap_of_all_and_of_the_leaders():
    """||m_i - m*|| = 5 for robot 1, 1 for the leader: cost gap 1^2."""
    found = metrics(run(ticks=shifted_references([[3.0, 4.0], [0.0, 1.0]])))
    assert (found.optimality_gap_m.mean, found.optimality_gap_m.final) == pytest.approx((3.0, 5.0))
    assert found.optimality_gap_m.p95 == pytest.approx(5.0)
    assert found.leader_optimality_gap_m == Statistics(1.0, 1.0, 1.0)
    assert found.cost_gap_m2 == Statistics(1.0, 1.0, 1.0)


def test_the_gap_is_taken_at_the_tick_of_the_solve():
    """m is off by 1 everywhere but at reference ticks."""
    m = resting(scenario()).m + 1.0
    m[SOLVED] -= 1.0
    assert metrics(run(ticks={"m": m})).optimality_gap_m == Statistics(0.0, 0.0, 0.0)


def test_the_cost_gap_is_against_the_recorded_cost():
    found = metrics(run(optima=replaced(optima(scenario()), cost=np.linspace(0.0, -1.0, len(SOLVED)))))
    assert found.cost_gap_m2.mean == pytest.approx(0.5)
    assert found.cost_gap_m2.final == pytest.approx(1.0)


def test_infeasible_and_failed_references_are_counted_and_left_out():
    status = np.array(["solved", "infeasible", "infeasible", "failed", "solved", "infeasible"])
    lost = status != "solved"
    m = np.where(lost[:, None], np.nan, optima(scenario()).m)
    found = metrics(run(optima=replaced(optima(scenario()), status=status, m=m, cost=np.where(lost, np.nan, 0.0))))
    assert found.reference_ticks == 6
    assert found.reference_infeasible_share == pytest.approx(0.5)
    assert found.reference_failed_share == pytest.approx(1 / 6)
    assert found.optimality_gap_m == Statistics(0.0, 0.0, 0.0)


def test_a_run_without_reference_solver():
    empty = optima(scenario(), 0)
    found = metrics(run(optima=empty)).as_dict()
    assert found["optimality_gap_m"] == {"mean": None, "p95": None, "final": None}
    assert (found["reference_ticks"], found["reference_infeasible_share"]) == (0, None)


def test_a_reference_whose_tick_was_lost_is_left_out():
    cut = replaced(optima(scenario()), index=SOLVED + 4, m=optima(scenario()).m + SOLVED[:, None])
    found = metrics(run(optima=cut))
    assert found.reference_ticks == 5
    assert found.optimality_gap_m.final == pytest.approx(16.0 * np.sqrt(2))


def test_wall_clock_and_network():
    """Built in 20 ms, solved in 30 ms at 6 of 21 ticks; five stages of 10 ms: 10 s took 1.35 s."""
    found = metrics(run())
    assert found.reference_build_ms.median == pytest.approx(20.0)
    assert found.reference_solve_ms.p95 == pytest.approx(30.0)
    assert found.governor_ms.median == pytest.approx(10.0)
    assert found.real_time_factor == pytest.approx(10.0 / (21 * 0.06 + 6 * 0.05))
    assert (found.rounds_per_tick, found.sent_per_robot_per_tick_bytes) == (10.0, 480.0)
    assert (found.sent_per_robot_per_second_bytes, found.sent_per_robot_total_bytes) == (960.0, 480.0 * 21)
    assert found.pre_stabiliser_per_robot_per_tick_bytes == 32.0  # two robots with one link


def test_bytes_are_a_mean_over_robots():
    sent = np.tile([100, 300], (STEPS, 1))
    assert metrics(run(ticks={"bytes_sent": sent})).sent_per_robot_per_tick_bytes == 200.0


def test_timings_switched_off():
    found = metrics(run(timings=timings(0))).as_dict()
    assert found["reference_solve_ms"] == found["governor_ms"] == {"median": None, "p95": None}
    assert found["real_time_factor"] is None


def test_settling_and_terminal_gap():
    """0.1 m off, then 0.03 m off from 4 s on."""
    q = resting(scenario()).hand_true.copy()
    q[:8, :, 1] += 0.1
    q[8:, :, 1] += 0.03
    found = metrics(run(ticks={"hand_true": q}))
    assert (found.settling_time_s, found.outcome) == (4.0, "converged")
    assert found.settling_time_including_violated_s == 4.0
    assert found.terminal_gap_m == pytest.approx(0.03)


def test_what_is_violated_settles_too_where_it_stays():
    """As above, but robot 1 touches a wall at once; then 0.1 m off up to the last second."""
    q, touched = resting(scenario()).hand_true.copy(), resting(scenario()).wall_contact.copy()
    q[:8, :, 1] += 0.1
    touched[0, 0] = True
    found = metrics(run(ticks={"hand_true": q, "wall_contact": touched}))
    assert (found.outcome, found.settling_time_including_violated_s) == ("violated", 4.0)
    assert np.isnan(found.settling_time_s)
    q[:-2, :, 1] += 0.1
    assert np.isnan(metrics(run(ticks={"hand_true": q, "wall_contact": touched})).settling_time_including_violated_s)


def test_settling_counts_from_the_last_change_of_the_reference():
    q, r = resting(scenario()).hand_true.copy(), resting(scenario()).reference.copy()
    q[:8, :, 1] += 0.1
    r[:5] += 0.5
    assert metrics(run(ticks={"hand_true": q, "reference": r})).settling_time_s == pytest.approx(4.0 - 2.5)


def test_the_terminal_gap_is_the_team_s_mean():
    q = resting(scenario()).hand_true.copy()
    q[-1, 0] += (0.0, 0.4)
    assert metrics(run(ticks={"hand_true": q})).terminal_gap_m == pytest.approx(0.2)


def test_the_true_margin_of_walls_is_the_world_s():
    margin = np.full((STEPS, 2), 0.5)
    margin[6, 1] = 0.125
    made = run(walled(), ticks={"wall_margin": margin})
    np.testing.assert_array_equal(true_margin(made.ticks, made.scenario), margin)
    assert metrics(made).true_margin_min_m == 0.125


def test_the_share_of_ticks_whose_governor_was_not_ok():
    status = np.where(np.arange(STEPS) < 7, "infeasible", "ok")
    assert metrics(run(ticks={"status": status})).governor_not_ok_share == pytest.approx(1 / 3)


def test_summaries():
    assert statistics(np.arange(101.0)) == Statistics(50.0, 95.0, 100.0)
    assert statistics(np.array([[9.0, 9.0], [1.0, 2.0]])).final == 2.0
    assert np.isnan(statistics(np.empty((0, 2))).mean)


def test_the_consensus_spread_is_the_logged_one():
    found = metrics(run(ticks={"consensus_spread": np.arange(float(STEPS))})).consensus_spread_m
    assert (found.mean, found.final) == (10.0, 20.0)


def test_wind_up_counts_ticks_at_which_anybody_winds_up():
    winding = np.zeros((STEPS, 2), dtype=bool)
    winding[3:7, 0] = winding[5:9, 1] = True
    assert metrics(run(ticks={"winding_up": winding})).winding_up_s == 3.0


def test_the_margin_at_rest_is_the_last_one_and_nothing_on_the_move():
    margin = np.linspace(1.0, 0.25, STEPS)[:, None] + np.array([0.0, 0.125])
    assert metrics(run(walled(), ticks={"wall_margin": margin})).rest_margin_m == 0.25
    q = resting(walled()).hand_true + np.linspace(0.0, 0.5, STEPS)[:, None, None]
    assert metrics(run(walled(), ticks={"wall_margin": margin, "hand_true": q})).as_dict()["rest_margin_m"] is None


def test_the_gap_between_robots_is_between_bodies():
    pose = resting(walled()).body_pose_true.copy()
    pose[8, 1, :2] = pose[8, 0, :2] + (0.3, 0.4)
    assert metrics(run(walled(), ticks={"body_pose_true": pose})).robot_gap_min_m == pytest.approx(0.5 - 0.12)
    # In the ideal plant too, where nothing keeps bodies apart.
    assert metrics(run(scenario(), ticks={"body_pose_true": pose})).robot_gap_min_m == pytest.approx(0.5 - 0.12)


def test_the_first_half_space_and_the_largest_integral_state():
    active = np.arange(STEPS)[:, None, None] >= np.array([6, 5])[:, None]
    xi = np.zeros((STEPS, 2, 2))
    xi[3, 1] = (3.0, -4.0)
    found = metrics(run(ticks={"half_space_active": active, "xi": xi}))
    assert (found.first_half_space_s, found.xi_max_m) == (2.5, 5.0)
    nobody = metrics(run(ticks={"half_space_active": np.zeros((STEPS, 2, 1), dtype=bool)}))
    assert nobody.as_dict()["first_half_space_s"] is None


def test_a_diverged_run_still_has_numbers_and_valid_json():
    m = resting(scenario()).m.copy()
    m[3], m[9:] = 1e300, np.nan
    found = metrics(run(ticks={"m": m}))
    assert found.outcome == "diverged"
    json.dumps(found.as_dict(), allow_nan=False)


def test_an_empty_log_is_refused():
    with pytest.raises(InputError, match="no complete tick"):
        metrics(run(ticks=vars(resting(scenario(), 0))))


def test_names_carry_units():
    bare = {
        "log",
        "scenario",
        "plant",
        "governor",
        "centralized",
        "seed",
        "robots",
        "damage",
        "ticks",
        "outcome",
        "reason",
    }
    bare |= {"binding", "violation_robot", "violation_kind", "wall_contacts", "moving_contacts", "robot_contacts"}
    bare |= {"moving_contacts_avoidable"}
    bare |= {"ended", "own_certificate", "reference_ticks", "rounds_per_tick", "real_time_factor"}
    units = ("_m", "_m2", "_s", "_ms", "_bytes", "_share")
    for name in RunMetrics.__dataclass_fields__:
        assert name in bare or name.endswith(units), name
