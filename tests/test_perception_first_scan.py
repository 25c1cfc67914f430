"""Before its first scan a robot knows nothing to be free, and stays where it is."""

from __future__ import annotations

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.loop.tick import govern_and_command, initial_state, sense_and_perceive

WALL = {"from": [0.22, -2.0], "to": [0.22, 2.0], "thickness": 0.04}
TEAM = {"start": [[0.0, 0.0], [-0.6, 0.0]], "formation": [[0.9, 0.0], [-0.9, 0.0]], "leaders": [1]}
KEYS = {
    "team": TEAM,
    "graph": {"kind": "complete"},
    "operator": {"reference": [0.0, 0.0]},
    "world": {"walls": [WALL]},
    "sensors": {"beams": {"preset": "lds_02"}},
}


def test_a_robot_whose_scans_take_time_does_not_drive_at_a_wall_before_the_first() -> None:
    """Its place is beyond a wall 0.2 m ahead, so that it is asked to drive there at once."""
    simulation = Simulation.build(pbrg.load(KEYS, {"set_up": "recommended"}, duration=1.0).settings)
    moved, margins, first = [], [], None
    for tick in simulation.control_ticks():
        truth = simulation.loop.world.truth()
        margins.append(truth.wall_margin[0])
        moved.append(np.abs(truth.hand_world - TEAM["start"]).max())
        if first is None and tick.readings.new_scan:
            first = tick.index
    assert first is not None and first >= 20  # a scan takes 0.2 s
    assert max(moved[: first + 1]) < 2e-3
    assert max(moved) > 0.05
    assert min(margins) > 0.0


def test_robots_with_beams_are_held_and_the_first_scan_finds_what_it_finds_without_that() -> None:
    keys = {**KEYS, "sensors": {"beams": {"preset": "lds_02", "robots": [1]}}}
    recommended = {"set_up": "recommended", "estimator.source": "points", "estimator.scope": "own"}
    recommended |= {"estimator.half_spaces_per_robot": 8}
    loop = Simulation.build(pbrg.load(keys, recommended, duration=1.0).settings).loop
    state, estimator = initial_state(loop), loop.goal_directed
    assert estimator is not None
    for index in range(40):
        sensed = sense_and_perceive(loop, state, index)
        if sensed.readings.new_scan:
            break
        spaces = sensed.half_spaces
        np.testing.assert_array_equal(spaces.active.sum(axis=1), [4, 0])
        np.testing.assert_array_equal(spaces.binds.sum(axis=(1, 2)), [4, 0])
        np.testing.assert_allclose(spaces.h[0, :4], spaces.G[0, :4] @ np.array(TEAM["start"])[0], atol=5e-3)
        np.testing.assert_allclose(spaces.G[0, :4].sum(axis=0), 0.0)
        assert state.half_spaces is None or spaces is state.half_spaces
        state, tick = govern_and_command(loop, state, sensed)
        loop.world.advance(tick.command)
    assert index >= 20
    fresh = state.estimator._replace(half_spaces=estimator.init().half_spaces)
    held, _ = estimator.step_towards(sensed.readings, sensed.time, state.estimator, state.m)
    free, _ = estimator.step_towards(sensed.readings, sensed.time, fresh, state.m)
    assert held.active[0].any() and not held.active[1].any()
    for name in ("G", "h", "active", "binds"):
        np.testing.assert_array_equal(getattr(held, name), getattr(free, name))


def test_a_team_without_beams_keeps_the_half_spaces_it_has() -> None:
    """None, and the same ones in every tick: rows are made anew where half-spaces are."""
    points = {"estimator.source": "points", "estimator.scope": "own", "estimator.half_spaces_per_robot": 8}
    keys = {**KEYS, "sensors": {"beams": {"robots": []}}}
    simulation = Simulation.build(pbrg.load(keys, {"set_up": "recommended", **points}, duration=0.1).settings)
    seen = [tick.half_spaces for tick in simulation.control_ticks()]
    assert not seen[0].active.any()
    assert all(one is seen[0] for one in seen)
