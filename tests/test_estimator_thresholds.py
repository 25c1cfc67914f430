"""`estimator.thresholds`: in the robot's own clearances, and each reaches the code that it is for."""

from __future__ import annotations

from typing import Any

import pytest

import pbrg_mj as pbrg
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.schema.thresholds import Thresholds
from pbrg_mj.world.scene.robot import load_robot_model
from tests.perceiving import scenario, setup, walk
from tests.raycast import Scene

SCALED = [name for name, field in Thresholds.model_fields.items() if "[clearances]" in str(field.description)]


def resolved(given: Any, clearance: float) -> dict[str, float]:
    """All numbers that both estimators take from a scenario."""
    robot = load_robot_model(given.robot)
    parts = perception_setup(given, clearance).parameters
    numbers = {**parts.line._asdict(), **parts.track._asdict(), **point_parameters(given, robot)._asdict()}
    return {name: value for name, value in numbers.items() if isinstance(value, (int, float))}


def test_defaults_are_lengths_of_the_generic_robot_to_the_last_bit() -> None:
    track, line = setup(scenario()).parameters.track, setup(scenario()).parameters.line
    lengths = {"free_gap": 0.15, "hidden_gap": 0.6, "face_depth": 0.3, "corner_reach": 0.2, "team_gap": 0.05}
    lengths |= {"end_uncertainty": 0.15, "passed_by": 0.1, "slot_hysteresis": 0.1, "extent_margin": 0.05}
    assert {name: getattr(track, name) for name in lengths} == lengths
    assert line.least_gap == 0.1


@pytest.mark.parametrize("name", Thresholds.model_fields)
def test_every_key_changes_one_number_of_an_estimator(name: str) -> None:
    default = getattr(Thresholds(), name)
    before = resolved(scenario(), 0.1)
    after = resolved(scenario(estimator={"thresholds": {name: 1.1 * default}}), 0.1)
    changed = [key for key in before if after[key] != before[key]]
    assert len(changed) == 1


@pytest.mark.parametrize("name", SCALED)
def test_lengths_of_the_robot_grow_with_its_clearance(name: str) -> None:
    half = scenario(estimator={"thresholds": {name: 0.5 * getattr(Thresholds(), name)}})
    small, large = resolved(scenario(), 0.1), resolved(half, 0.2)
    points = {"joining": "least_joining", "straight_length": "straight_length"}
    if name in points:  # of the robot's own model
        robot = load_robot_model("turtlebot3_burger")
        of_robot = point_parameters(scenario(robot="turtlebot3_burger"), robot)
        expected = getattr(Thresholds(), name) * robot.clearance
        assert getattr(of_robot, points[name]) == pytest.approx(expected)
    else:
        assert large[name] == pytest.approx(small[name])


@pytest.mark.parametrize(("long_extent", "at_once"), [(1.0, True), (3.0, False)])
def test_a_wall_of_three_metres_is_known_at_once_unless_walls_are_longer(long_extent: float, at_once: bool) -> None:
    wall = Scene(((1.0, -1.5, 1.0, 1.5),))
    given = scenario(estimator={"thresholds": {"long_extent": long_extent}})
    scans = [known.active.any() for _, _, known, _ in walk(given, lambda _: wall, lambda _: (0.0, 0.0, 0.0), 40)]
    assert scans[0] == at_once
    assert scans[-1]


def test_a_threshold_below_0_is_refused() -> None:
    with pytest.raises(pbrg.InputError, match=r"estimator\.thresholds\.free_gap"):
        pbrg.load("paper/simulation_near", {"estimator.thresholds.free_gap": -1})
