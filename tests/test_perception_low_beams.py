"""Beams below the wheels' tops: what a robot's own wheels hide is unknown, neither wall nor free space."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.scan.extract_lines import Lines, extract_lines
from pbrg_mj.perception.scan.points import BLOCKED
from pbrg_mj.perception.scan.self_occlusion import blocked_beams
from pbrg_mj.scenario.schema import Beams
from tests.perceiving import rows, scenario, setup, walk
from tests.raycast import Scene, cast, robot, wheels
from tests.scans import sensor

LOW = 0.03  # [m]
AHEAD = Scene(((1.0, -3.0, 1.0, 3.0),))
FINE = sensor(count=360)


def low(**beams: object) -> dict:
    return {"beams": {"height": LOW, **beams}}


def lines(ranges: np.ndarray) -> Lines:
    return extract_lines(ranges, FINE.directions, FINE.params)


def without(scene: Scene, first_deg: int, last_deg: int, reading: float) -> np.ndarray:
    """Ranges from the origin along +x, with `reading` for the beams between two directions [deg]."""
    ranges = cast(scene, np.zeros(3), 360)
    ranges[np.arange(first_deg, last_deg + 1)] = reading
    return ranges


def test_own_wheels_hide_a_sector_of_the_size_that_geometry_says() -> None:
    """At 30 mm a wheel of radius 20 mm is a chord of +- sqrt(300) mm, 45 mm abreast: 21.05 deg to either side of 90."""
    half = np.degrees(np.arctan(np.sqrt(300) / 45))
    fine = Beams.model_validate({"count": 1000, "height": LOW})
    off = np.abs(np.abs(np.arange(1000) * 0.36 - 180) - 90)  # from the axle [deg]
    np.testing.assert_array_equal(blocked_beams(fine)[np.abs(off - half) > 0.2], (off < half)[np.abs(off - half) > 0.2])
    assert blocked_beams(Beams.model_validate({"height": LOW})).sum() == 18
    assert not blocked_beams(Beams()).any()


def test_the_beams_that_are_read_past_own_wheels_are_those_of_the_scenario() -> None:
    given = setup(scenario(sensors=low(start_deg=90.0)))
    np.testing.assert_array_equal(np.flatnonzero(given.parameters.blocked), [*range(5), *range(32, 41), *range(68, 72)])


def test_a_wall_goes_on_behind_what_the_robot_hides_and_not_where_nothing_came_back() -> None:
    hidden, silent = lines(without(AHEAD, 10, 50, BLOCKED)), lines(without(AHEAD, 10, 50, np.nan))
    assert len(hidden) == 1 and hidden.high - hidden.low > 5.5
    assert len(silent) == 2 and np.sort(silent.low)[1] > 1.0
    assert silent.free_high[np.argmin(silent.low)] and silent.free_low[np.argmax(silent.low)]


def test_a_wall_has_no_end_where_the_robot_hides_the_rest() -> None:
    hidden, silent = lines(without(AHEAD, 10, 90, BLOCKED)), lines(without(AHEAD, 10, 90, np.nan))
    assert (hidden.free_high.tolist(), silent.free_high.tolist()) == ([False], [True])
    assert [*hidden.high, *silent.high] == pytest.approx([np.tan(np.radians(9))] * 2)


@pytest.mark.parametrize(("width", "whole"), [(0.11, False), (0.3, True)])
def test_what_is_no_wider_than_a_robot_does_not_continue_a_wall_behind_what_is_hidden(width: float, whole: bool):
    scene = Scene(((1.0, -3.0, 1.0, -0.45), (1.0, 0.45, 1.0, 0.5 + width)))
    ranges = without(scene, 0, 25, BLOCKED)
    ranges[-25:] = BLOCKED
    found = lines(ranges)
    assert len(found) == 1 and found.low < -2.5
    assert found.high == pytest.approx(0.5 + width if whole else -0.5, abs=0.04)


def test_few_beams_on_either_side_of_what_is_hidden_make_a_wall_together() -> None:
    ring, wall = sensor(count=24), Scene(((1.0, -2.0, 1.0, 2.0),))  # three beams on each side
    found = []
    for reading in (BLOCKED, np.nan):
        ranges = cast(wall, np.zeros(3), 24)
        ranges[[-1, 0, 1]] = reading
        found.append(extract_lines(ranges, ring.directions, ring.params))
    assert [len(some) for some in found] == [1, 0]
    assert found[0].offset == pytest.approx([1.0]) and found[0].angle == pytest.approx([0.0], abs=1e-9)


def drive_along(**beams: object) -> list[np.ndarray]:
    """What is known of a wall 1 m to the left of a robot that drives along it at 0.2 m/s, scan after scan."""

    def pose(time: float) -> tuple[float, float, float]:
        return -1.0 + 0.2 * time, 0.0, 0.0

    def scene(time: float) -> Scene:
        others = robot(np.array([0.6, -0.7, 1.0]), LOW) + robot(np.array([-1.8, 0.3, 2.0]), LOW)
        return Scene(((-4.0, 1.0, 4.0, 1.0),)) + others + wheels(np.array(pose(time)), LOW)

    return [np.column_stack(rows(known)) for _, _, known, _ in walk(scenario(sensors=low(**beams)), scene, pose, 100)]


@pytest.mark.parametrize("beams", [{}, {"range_min": 0.0}, {"preset": "robotarium"}])
def test_a_wall_beside_the_robot_is_found_and_stays_one_wall(beams: dict) -> None:
    known = drive_along(**beams)
    assert all(len(some) == 1 for some in known[3:])
    normal = np.array([some[0, :2] for some in known[3:]])
    assert np.all(normal @ [0.0, 1.0] > np.cos(np.radians(5.0)))
    # On the safe side of the wall less the clearance, where the robot is; never far from it.
    room = [some[0, 2] - some[0, 0] * (-1.0 + 0.02 * k) for k, some in enumerate(known[3:], start=3)]
    assert np.mean(np.array(room) > 0.9) < 0.01 and min(room) > 0.7


def test_a_wall_that_turns_out_of_sight_is_not_taken_for_gone() -> None:
    short = Scene(((-0.25, 1.0, 0.25, 1.0),)) + robot(np.array([-0.9, 0.2, 1.0]), LOW)

    def pose(time: float) -> tuple[float, float, float]:
        return 0.0, 0.0, np.pi / 2 if time < 4.0 else 0.0

    given, heard = scenario(sensors=low()), 0
    for time, _, known, memory in walk(given, lambda t: short + wheels(np.array(pose(t)), LOW), pose, 80):
        G, h = rows(known)
        if time > 4.5:
            assert len(G) == 1 and G[0] @ [0.0, 1.0] > 0.99 and 0.8 < h[0] < 0.9
            heard += int(memory.tracks[0]["unseen"].max() > 3)
    assert heard > 20  # out of sight indeed


def test_a_scan_of_nothing_but_own_wheels_is_one_without_any_echo() -> None:
    wall, pose = Scene(((1.0, -0.25, 1.0, 0.25),)), (0.0, 0.0, 0.0)
    own = wheels(np.array(pose), LOW)
    seen = walk(scenario(sensors=low()), lambda t: wall + own if t < 4.0 else own, lambda t: pose, 80)
    assert [len(rows(known)[0]) for time, _, known, _ in seen if time > 3.5] == [1] * 44


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.02])
def test_own_wheels_are_no_walls_even_if_their_ranges_are_reported(noise: float) -> None:
    given = scenario(sensors=low(range_min=0.0, noise_std=noise), estimator={"min_length": 0.02, "min_points": 3})
    pose = (0.3, -0.2, 0.7)
    for _, _, known, memory in walk(given, lambda t: wheels(np.array(pose), LOW), lambda t: pose, 30):
        assert not known.active.any() and not memory.tracks["live"].any()
