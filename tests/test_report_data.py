"""What the report's page holds: which frames, what of the ticks between, half-spaces as changes, events."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from pbrg_mj.analysis.events import MOST_EVENTS, events
from pbrg_mj.analysis.report import frames, scene
from pbrg_mj.analysis.report.encode import embedded, packed
from pbrg_mj.analysis.report.frames import frame_ticks, indicators, states
from pbrg_mj.analysis.report.half_space_changes import MOST_CHANGES, half_space_changes
from tests.runs import optima, replaced, resting, run, scenario, walled


def unpacked(column):
    values = np.frombuffer(base64.b64decode(column["data"]), "<f4")
    return values.reshape(-1, column["width"])


def test_packed_numbers_keep_seven_digits_and_their_rows():
    values = np.random.default_rng(3).normal(scale=10.0, size=(7, 3, 2))
    np.testing.assert_allclose(unpacked(packed(values)), values.reshape(7, 6), rtol=1e-7)
    assert packed(np.zeros((4, 0, 2))) == {"width": 0, "data": ""}
    assert packed(np.zeros((0, 5))) == {"width": 5, "data": ""}


def test_what_cannot_be_drawn_is_packed_as_nan():
    values = unpacked(packed(np.array([np.inf, -np.inf, np.nan, 1e300, -2.0])))[:, 0]
    np.testing.assert_array_equal(values, [np.nan, np.nan, np.nan, np.nan, -2.0])


def test_embedded_text_cannot_end_its_script_element():
    data = {"name": "</script><script>alert(1)</script>", "other": "<!-- & \u2028 \u00e9"}
    text = embedded(data)
    assert not set("<>&\u2028\u00e9") & set(text)
    assert json.loads(text) == data


def test_every_tick_of_a_short_run_is_a_frame():
    np.testing.assert_array_equal(frame_ticks(run(), 1), np.arange(21))


def test_frames_of_a_long_run_are_evenly_spaced_and_end_with_its_last_tick(monkeypatch):
    monkeypatch.setattr(frames, "MOST_FRAMES", 6)
    np.testing.assert_array_equal(frame_ticks(run(), 1), [0, 4, 8, 12, 16, 20])
    monkeypatch.setattr(frames, "MOST_FRAMES", 5)
    np.testing.assert_array_equal(frame_ticks(run(), 1), [0, 5, 10, 15, 20])
    monkeypatch.setattr(frames, "MOST_FRAMES", 4)
    np.testing.assert_array_equal(frame_ticks(run(), 1), [0, 6, 12, 18, 20])


def test_many_runs_share_what_a_page_may_hold(monkeypatch):
    monkeypatch.setattr(frames, "MOST_NUMBERS", 6 * (9 * 2 + 12))
    assert len(frame_ticks(run(), 1)) == 6
    assert len(frame_ticks(run(), 3)) == 3  # every 11th tick of 21, and the last


def test_a_frame_shows_the_worst_of_the_ticks_since_the_frame_before():
    plan = walled()
    margin, spread, multipliers = np.full((21, 2), 1.0), np.zeros(21), np.zeros((21, 2, 2))
    margin[7, 1], spread[9], multipliers[10, 0, 1] = 0.1, 0.3, 4.0
    given = {"wall_margin": margin, "consensus_spread": spread, "multipliers": multipliers}
    shown = indicators(run(plan, ticks=given), np.array([0, 5, 10, 15, 20]))
    np.testing.assert_array_equal(shown["margin"], [[1, 1], [1, 1], [1, 0.1], [1, 1], [1, 1]])
    np.testing.assert_array_equal(shown["spread"], [0, 0, 0.3, 0, 0])
    np.testing.assert_array_equal(shown["multiplier"], [[0, 0], [0, 0], [4, 0], [0, 0], [0, 0]])


def test_the_centralized_answer_is_held_until_the_next_and_unknown_before_the_first():
    plan = scenario()
    solved = optima(plan)  # at ticks 0, 4, 8, ...
    solved = replaced(solved, m=np.arange(12.0).reshape(6, 2), index=solved.index + 2)
    m = resting(plan).m.copy()
    m[6, 1] = (2.0, 3.0 + 0.5)  # the second optimum is (2, 3)
    seen = run(plan, ticks={"m": m}, optima=solved)
    at = np.array([0, 1, 2, 5, 6, 7])
    star = states(seen, at)["mstar"]
    np.testing.assert_array_equal(star, [[np.nan] * 2] * 2 + [[0, 1], [0, 1], [2, 3], [2, 3]])
    shown = indicators(seen, at)
    np.testing.assert_allclose(shown["leader_gap"][-2:], 0.5)  # robot 2 leads
    np.testing.assert_allclose(shown["gap"][-1], np.hypot(1.0, 3.0))  # robot 1 is still at (1, 0)


def test_a_run_without_centralized_solves_has_no_gap():
    seen = run()
    none = replaced(seen.optima, **{name: value[:0] for name, value in vars(seen.optima).items()})
    shown = indicators(replaced(seen, optima=none), np.arange(21))
    assert np.isnan(shown["gap"]).all()
    assert np.isnan(shown["multiplier_star"]).all()


def random_half_spaces(seed=5, ticks=40, n=2, slots=3):
    rng = np.random.default_rng(seed)
    scans = rng.normal(size=(ticks // 4, n, slots, 3)).repeat(4, axis=0)
    active = (rng.random((ticks // 4, n, slots)) < 0.6).repeat(4, axis=0)
    plan = scenario()
    values = {name: np.resize(value, (ticks, *value.shape[1:])) for name, value in vars(resting(plan)).items()}
    values |= {"half_space_G": scans[..., :2], "half_space_h": scans[..., 2], "half_space_active": active}
    return run(plan, ticks=values)


@pytest.mark.parametrize("most", [10_000, 30])
def test_changes_put_together_again_are_the_half_spaces_of_each_frame(most):
    seen = random_half_spaces()
    ticks = np.arange(0, 40, 2)
    changes = half_space_changes(seen, ticks, most)
    assert len(changes.frame) <= most
    shown = [f for f in range(len(ticks)) if most > 1000 or f in changes.frame]
    assert len(shown) >= 3
    now: dict[int, tuple[float, ...]] = {}
    for frame in range(len(ticks)):
        for row in changes.table()[changes.frame == frame]:
            now[int(row[1])] = tuple(row[2:])
        if frame in shown:
            t, tick = seen.ticks, ticks[frame]
            wanted = {
                3 * j + k: (*t.half_space_G[tick, j, k], t.half_space_h[tick, j, k])
                for j, k in np.argwhere(t.half_space_active[tick]).tolist()
            }
            assert {slot: value for slot, value in now.items() if not np.isnan(value[0])} == wanted


def test_half_spaces_that_stay_are_told_once():
    changes = half_space_changes(run(), np.arange(21), MOST_CHANGES)
    np.testing.assert_array_equal(changes.table(), [[0, 0, 1, 0, 2]])


def test_moving_boxes_are_where_the_stops_say():
    stops = ({"time": 2.0, "center": (0.0, 3.0)}, {"time": 4.0, "center": (2.0, 3.0)})
    plan = walled()
    world = plan.world.model_validate({"walls": (), "moving_boxes": ({"size": (0.4, 0.2), "waypoints": stops},)})
    sizes, centres = scene.moving(run(plan.model_copy(update={"world": world})), np.array([0.0, 2.5, 9.0]))
    assert sizes == [(0.4, 0.2)]
    np.testing.assert_allclose(centres[:, 0], [[0, 3], [0.5, 3], [2, 3]])


def test_walls_and_boxes_are_drawn_with_their_corners():
    plan = walled()
    box = {"center": (1.0, 1.0), "size": (2.0, 1.0), "angle_deg": 90.0}
    patch = {"from": (0.0, 0.0), "to": (1.0, 2.0)}
    wall = {"from": (0.0, -1.0), "to": (4.0, -1.0), "thickness": 0.2}
    world = plan.world.model_validate({"walls": (wall,), "boxes": (box,), "patches": (patch,)})
    shapes = scene.still(run(plan.model_copy(update={"world": world})))
    assert [shape["kind"] for shape in shapes] == ["patch", "wall", "box"]
    corners = [{tuple(np.round(corner, 9)) for corner in shape["corners"]} for shape in shapes]
    assert corners[0] == {(0, 0), (1, 0), (1, 2), (0, 2)}
    assert corners[1] == {(0, -1.1), (4, -1.1), (4, -0.9), (0, -0.9)}
    assert corners[2] == {(0.5, 0), (1.5, 0), (1.5, 2), (0.5, 2)}


def test_the_floor_shown_holds_robots_and_reference_but_not_what_runs_away():
    seen = run()
    at = np.arange(21)
    x0, y0, x1, y1 = scene.extent(seen, states(seen, at))
    assert x0 < 1 < x1
    assert y0 < -1 < 0 < y1
    assert max(x1 - x0, y1 - y0) < 2
    runaway = {"m": np.full((21, 2, 2), 1e9), "hand_true": seen.ticks.hand_true.copy()}
    runaway["hand_true"][15:] = np.nan
    runaway["hand_true"][14] = 1e9
    assert scene.extent(seen, states(run(ticks=runaway), at)) == [x0, y0, x1, y1]


def test_events_name_what_happened_when():
    plan = walled()
    status, touch, r = np.full(21, "ok", dtype="<U10"), np.zeros((21, 2), dtype=bool), resting(plan).reference.copy()
    status[4:6], touch[8:11, 1], r[12:] = "infeasible", True, (0.5, 0.25)
    winding = np.zeros((21, 2), dtype=bool)
    winding[10:14, 0] = True
    told = events(run(plan, ticks={"status": status, "wall_contact": touch, "winding_up": winding, "reference": r}))
    assert [(event.time, event.text, event.serious) for event in told] == [
        (2.0, "governor: infeasible", True),
        (3.0, "governor: ok", False),
        (4.0, "robot 2 touches a wall", True),
        (5.0, "robot 1: integrator wind-up for 1.5 s", False),
        (6.0, "new reference (0.5, 0.25) m", False),
        (10.0, "violated: at 4 s robot 2 touched a wall", True),
    ]


def test_very_many_events_are_counted_not_listed():
    touch = np.zeros((21, 20), dtype=bool)
    touch[::2] = True  # 11 times 20 touches
    told = events(run(walled(), ticks={"wall_contact": touch}))
    assert told[MOST_EVENTS].text == f"and {220 - MOST_EVENTS} more from here on"
    assert told[MOST_EVENTS + 1].text == "violated: at 0 s robot 1 touched a wall"  # the end is always told
