"""Robots that differ from their model, against closed forms of what differs."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import load_text, parse_scenario
from pbrg_mj.scenario.robots import ROBOTS
from pbrg_mj.scenario.schema.team import Variation
from pbrg_mj.world.plant.compose import compose, model_xml
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.scenario_texts import THREE
from tests.worlds import scenario

ROBOT = load_robot_model()
VOLTAGE = 2.0


def varied(robots: int = 1, name: str = "generic", drive: float = 0.0, **variation):
    """Robots with these scales, without friction unless told."""
    return scenario(robots, robot=name, team={"variation": variation}, drive={"friction": drive})


def speeds(one, ticks: int) -> np.ndarray:
    """Drive all robots ahead; return their speeds (ticks, n) [m/s] over each tick."""
    plant, places = MujocoPlant(one), []
    for _ in range(ticks + 1):
        places.append(plant.truth().hand_world[:, 0])
        plant.advance(np.full((one.robots, 2), VOLTAGE * plant.robot.voltage / ROBOT.voltage))
    return np.diff(places, axis=0) / one.timing.tick


def test_models_are_the_same_bit_for_bit_where_nothing_differs():
    plain, ones = scenario(2), varied(2, drive=1.0, mass=1.0, wheel_radius=(1.0, 1.0))
    assert model_xml(compose(plain, ROBOT)) == model_xml(compose(ones, ROBOT))


def test_each_robot_has_its_own_mass_and_inertia():
    model = compose(varied(2, mass=(1.1, 0.9)), ROBOT).compile()
    for j, scale in enumerate((1.1, 0.9)):
        assert model.body(f"robot{j}/robot").subtreemass[0] == pytest.approx(scale * ROBOT.mass)
        assert model.body(f"robot{j}/robot").inertia[2] == pytest.approx(scale * 6.5e-4)
    first = speeds(varied(2, mass=(1.25, 0.8)), 3)[0]  # slower to begin with; the wheels' rotors weigh as before
    assert first[0] < first[1]


def test_speed_falls_with_the_motor_constant_and_grows_with_the_wheels():
    last = speeds(varied(3, motor_constant=(1.0, 1.1, 1.0), wheel_radius=(1.0, 1.0, 0.97)), 120)[-1]
    np.testing.assert_allclose(last / last[0], [1.0, 1 / 1.1, 0.97], rtol=1e-3)


def test_the_time_constant_falls_with_the_square_of_the_motor_constant():
    rising = speeds(varied(2, motor_constant=(1.0, 1.2)), 150)
    lag = (1.0 - rising / rising[-1]).sum(axis=0)  # area above a first-order step response: its time constant
    assert lag[1] / lag[0] == pytest.approx(1 / 1.2**2, rel=0.05)


def test_friction_takes_its_closed_form_off_the_speed_on_patches_too():
    scales, patch = (0.8, 1.3), {"from": (-1.0, -1.0), "to": (9.0, 1.0), "rolling_resistance": 0.0}
    for patches in ((), (patch,)):
        one = scenario(2, team={"variation": {"friction": scales}}, world={"patches": patches})
        last = speeds(one, 120)
        share = VOLTAGE / ROBOT.voltage - np.array(scales) * ROBOT.coulomb_torque / ROBOT.stall_torque
        np.testing.assert_allclose(last[-1], ROBOT.top_speed * share, rtol=0.01)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_on_larger_wheels_stands_on_the_floor_and_goes_faster(name):
    one = varied(2, name, wheel_radius=(1.0, 1.05))
    plant = MujocoPlant(one)
    before = plant.data.qpos.copy()
    for _ in range(50):
        plant.advance(np.zeros((2, 2)))
    np.testing.assert_allclose(plant.data.qpos, before, atol=2e-4)
    last = speeds(one, 120)[-1]
    assert last[1] / last[0] == pytest.approx(1.05, rel=2e-3)


def test_families_draw_each_robots_parameters():
    text = """
description: "A wall"
team: {leaders: [1]}
draw:
  team: {robots: 3, start_radius: 0.5, formation_radius: 0.4}
  reference: {distance: 2.0}
  keys:
    team.variation.mass: {uniform: [0.9, 1.1], per_robot: true}
    team.variation.wheel_radius: {normal: [1.0, 0.01]}
"""
    drawn = [load_text(text, "f", [f"seed={seed}"], file="f.yaml").scenario.team.variation for seed in (1, 2)]
    assert len(drawn[0].mass) == 3 and len({*drawn[0].mass, *drawn[1].mass}) == 6
    assert drawn[0].wheel_radius != drawn[1].wheel_radius
    assert drawn[0].friction == 1.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("mass: [1, 1]", r"team\.variation\.mass.* has 2 entries"),
        ("friction: 3", r"team\.variation\.friction"),
    ],
)
def test_wrong_scales_are_refused(keys, message):
    with pytest.raises(InputError, match=message):
        parse_scenario(THREE.replace("  leaders: [3]", f"  leaders: [3]\n  variation: {{{keys}}}"))


@pytest.mark.parametrize("name", Variation.model_fields)
def test_the_ideal_plant_refuses_them(name):
    text = THREE.replace("  leaders: [3]", f"  leaders: [3]\n  variation: {{{name}: 1.1}}")
    with pytest.raises(InputError, match="ideal plant ignores"):
        parse_scenario(text + "plant: ideal\nestimator: {source: given}\n")
