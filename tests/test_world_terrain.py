"""Thresholds and ramps: robots drive over them or are stopped, and nobody takes them for obstacles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.plant.interface import Truth
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.scenario_texts import three
from tests.worlds import scenario, wall

SEE = {"preset": "ideal", "count": 4, "robots": "all", "range_max": 20.0}
GRAVITY = 9.81


def threshold(height: float, x: float = 0.3) -> dict[str, Any]:
    return {"from": (x, -0.5), "to": (x, 0.5), "height": height}


def ramp(slope_deg: float, length: float = 1.0) -> dict[str, Any]:
    height = length * np.tan(np.deg2rad(slope_deg))
    return {"from": (0.3, 0.0), "to": (0.3 + length, 0.0), "width": 1.0, "height": height}


def driven(around: dict[str, Any], volts: float, seconds: float, **sections: Any) -> tuple[MujocoPlant, list[Truth]]:
    plant = MujocoPlant(scenario(world=around, **sections))
    truths = []
    for _ in range(round(seconds / 0.01)):
        plant.advance(np.full((1, 2), volts))
        truths.append(plant.truth())
    return plant, truths


def pitch_deg(plant: MujocoPlant) -> float:
    """Return by how much the nose points up [deg]."""
    return float(np.rad2deg(np.arcsin(plant.data.body("robot0/robot").xmat[6])))


def touched(truths: list[Truth]) -> bool:
    return any(one.wall_contact.any() or one.moving_contact.any() or one.robot_contact.any() for one in truths)


@pytest.mark.parametrize(("height", "over"), [(0.002, True), (0.004, True), (0.008, False), (0.03, False)])
def test_low_thresholds_are_climbed_and_high_ones_stop_a_robot(height: float, over: bool) -> None:
    """The generic robot's casters are balls of 6 mm: no force turns them over a step as high."""
    plant, truths = driven({"thresholds": [threshold(height)]}, 2.0, 2.5)
    x, y, heading = truths[-1].body_pose[0]
    assert abs(y) < 1e-3 and abs(heading) < 1e-3
    if over:
        assert x > 0.3 + 0.1 and truths[-1].wheel_speed[0, 0] > 10
        assert abs(plant.data.body("robot0/robot").xpos[2] - 0.02) < 5e-4
    else:
        front = 0.06 if height > 0.01 else 0.041  # [m] the skirt, 10 mm above the floor, or the front caster
        assert x == pytest.approx(0.3 - 0.015 - front, abs=4e-3) and truths[-1].wheel_speed[0, 0] < 0.1
    assert not touched(truths)
    assert np.isinf(truths[-1].wall_margin[0])


def test_a_ramp_tilts_a_robot_by_its_slope_and_costs_the_volts_of_its_weight() -> None:
    """In the steady state the motors push m g sin(slope) more than on the floor: V falls back by that force's speed."""
    plant, truths = driven({"ramps": [ramp(3.0)]}, 2.0, 2.5)
    _, level = driven({}, 2.0, 2.5)
    assert pitch_deg(plant) == pytest.approx(3.0, abs=0.1)
    assert plant.data.body("robot0/robot").xpos[2] > 0.03
    assert not touched(truths)
    robot = plant.robot
    force = robot.mass * GRAVITY * np.sin(np.deg2rad(3.0))
    drop = force / 2 * robot.wheel_radius / (robot.stall_torque / robot.no_load_speed)  # of the wheels' speed [rad/s]
    assert level[-1].wheel_speed[0, 0] - truths[-1].wheel_speed[0, 0] == pytest.approx(drop, rel=0.05)


def test_a_robot_at_rest_stays_on_a_ramp_with_its_gears_friction() -> None:
    plant, _ = driven({"ramps": [ramp(1.0)]}, 2.0, 2.5)
    for _ in range(100):
        plant.advance(np.zeros((1, 2)))
    before = plant.truth().body_pose
    for _ in range(200):
        plant.advance(np.zeros((1, 2)))
    assert pitch_deg(plant) == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(plant.truth().body_pose, before, atol=5e-4)


def test_beams_pass_over_thresholds_and_meet_a_ramp_at_their_own_height() -> None:
    """The generic robot's beams are 0.049 m up: a ramp as low is not seen, a higher one where it is that high."""
    behind = wall((5.05, -2), (5.05, 2))
    for around, want in (
        ({"thresholds": [threshold(0.04)]}, 5.0),
        ({"ramps": [ramp(2.0)]}, 5.0),
        ({"ramps": [ramp(5.0)]}, 0.3 + 0.049 / np.tan(np.deg2rad(5.0))),
    ):
        plant = MujocoPlant(scenario(world={"walls": [behind], **around}, beams=SEE))
        assert plant.observe().ranges[0, 0] == pytest.approx(want + plant.robot.hand_offset, abs=1e-3)


def test_on_a_ramp_the_beam_astern_meets_the_floor() -> None:
    """Level ground lies behind: at the slope's angle below the beam, however far the walls are."""
    plant, truths = driven({"ramps": [ramp(3.0)]}, 2.0, 2.0, beams={**SEE, "rate_hz": 100.0})
    x, slope = truths[-1].body_pose[0, 0], np.deg2rad(pitch_deg(plant))
    height = plant.data.body("robot0/robot").xpos[2] + 0.029 * np.cos(slope)
    assert x > 0.4
    assert plant.observe().ranges[0, 2] == pytest.approx(height / np.sin(slope), rel=0.03)


def test_skirts_against_a_threshold_are_no_robots_and_robots_still_are() -> None:
    """The first robot pushes against a bar, the second one against the first."""
    around = {"thresholds": [threshold(0.03, 0.7)]}
    plant = MujocoPlant(scenario(2, world=around))
    seen = []
    for _ in range(250):
        plant.advance(np.array([[3.0, 3.0], [2.0, 2.0]]))
        names = {plant.model.geom(geom).name for pair in plant.data.contact.geom for geom in pair}
        at_bar = {"threshold0", "robot1/skirt"} <= names
        seen.append((at_bar, *plant.truth().robot_contact))
    told = np.array(seen)
    alone = told[:, 0] & ~told[:, 1]
    assert alone.sum() > 20 and not told[alone, 2].any()
    assert told[-1].all()


def test_a_batch_drives_as_one_plant_does() -> None:
    given = scenario(1, world={"thresholds": [threshold(0.002, 0.15)], "ramps": [ramp(3.0)]})
    alone, many = MujocoPlant(given), PlantBatch(given, 2, 1)
    hand, numbers = np.empty((2, 1, 2)), [np.empty((2, 1)), *(np.empty((2, 1), dtype=bool) for _ in range(2))]
    for _ in range(100):
        alone.advance(np.full((1, 2), 2.0))
        many.advance(np.full((2, 1, 2), 2.0))
        many.truth(hand, *numbers)
        np.testing.assert_array_equal(hand, [alone.truth().hand_world] * 2)


def test_level_worlds_have_the_sensors_that_they_had() -> None:
    assert "ground_contacts" not in MujocoPlant(scenario()).model_xml


@pytest.mark.parametrize(
    ("world", "says"),
    [
        ("{thresholds: [{from: [0, 5], to: [1, 5], height: 0.05}]}", "world.thresholds.0.height: is 0.05; allowed: "),
        ("{thresholds: [{from: [0, 5], to: [0, 5], height: 0.01}]}", "world.thresholds.0: runs from"),
        ("{ramps: [{from: [1, 5], to: [1, 5], width: 1, height: 0.1}]}", "world.ramps.0: runs from"),
        ("{ramps: [{from: [-1, 0], to: [1, 0], width: 1, height: 0.1}]}", "world.ramps.0: stands in robot 1"),
        ("{thresholds: [{from: [-1, 0], to: [0, 0], height: 0.01}]}", "world.thresholds.0: stands in robot 1"),
    ],
)
def test_what_cannot_be_driven_on_is_refused(world: str, says: str) -> None:
    with pytest.raises(InputError) as told:
        parse_scenario(three(world=world), "x.yaml")
    assert says in str(told.value)


def test_omnidirectional_robots_have_no_wheels_to_climb_with() -> None:
    text = three(robot="omni", world="{ramps: [{from: [0, 5], to: [1, 5], width: 1, height: 0.1}]}")
    with pytest.raises(InputError, match=r"world\.ramps: is given; allowed: with robots on two wheels"):
        parse_scenario(text, "x.yaml")
