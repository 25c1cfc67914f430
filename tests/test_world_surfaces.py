"""Reflectance of walls, boxes, columns and prisms: the plant tells which surface a ray met."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.schema import WHITE
from pbrg_mj.sensing.noise import noise_parameters
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.scenario_texts import three
from tests.worlds import scenario, wall

LIT: dict[str, Any] = {"preset": "ideal", "robots": "all", "signal_range": 3.0}
L_SHAPE = [(-1.4, -0.3), (-0.8, -0.3), (-0.8, -0.1), (-1.2, -0.1), (-1.2, 0.3), (-1.4, 0.3)]
AROUND = {
    "walls": [{**wall((1.0, -0.4), (1.0, 0.4)), "reflectance": 0.05}, wall((3.0, -9.0), (3.0, 9.0))],
    "boxes": [{"center": (0.3, 1.0), "size": (0.5, 0.2), "angle_deg": 20.0, "reflectance": 0.17}],
    "columns": [{"center": (0.0, -0.8), "radius": 0.2, "reflectance": 0.4}],
    "prisms": [{"corners": L_SHAPE, "reflectance": 0.6}],
}


def reflectances(around: dict[str, Any], count: int = 72, **beams: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the reflectances (n, rays) that a plant tells, and the ranges."""
    seen = MujocoPlant(scenario(world=around, beams={**LIT, "count": count, **beams})).observe()
    assert seen.reflectances is not None
    return seen.reflectances, seen.ranges


def test_each_ray_is_told_the_reflectance_of_what_it_meets() -> None:
    """Against worlds in which one thing alone stands: a ray meets that thing whose lone range it has."""
    told, ranges = reflectances(AROUND)
    told, ranges = told[0], ranges[0]
    met = set()
    for kind, things in AROUND.items():
        for thing in things:
            plant = MujocoPlant(scenario(world={kind: [thing]}, beams={**LIT, "count": 72}))
            alone = (plant.observe().ranges[0] == ranges) & (ranges > 0)
            assert alone.any()
            assert (told[alone] == thing.get("reflectance", WHITE)).all()
            met |= set(told[alone].tolist())
    assert met == {0.05, 0.17, 0.4, 0.6, WHITE}
    assert (told[ranges < 0] == WHITE).all()


def test_beams_over_a_low_thing_or_through_a_pane_meet_what_is_behind() -> None:
    behind = {**wall((2.0, -1.0), (2.0, 1.0)), "reflectance": 0.3}
    before = {**wall((1.0, -1.0), (1.0, 1.0)), "reflectance": 0.1}
    for given, want in (({}, 0.1), ({"height": 0.02}, 0.3), ({"glass": True}, 0.3)):
        told, ranges = reflectances({"walls": [before | given, behind]}, count=4)
        assert told[0, 0] == want
        assert (ranges[0, 0] > 1.5) == (want == 0.3)


def test_a_dark_plinth_flush_with_a_white_wall_is_dark_below_its_top_alone() -> None:
    white = wall((1.0, -1.0), (1.0, 1.0))
    for height, want in ((0.02, WHITE), (0.2, 0.1)):  # beams are 0.049 m up
        told, _ = reflectances({"walls": [white, {**white, "reflectance": 0.1, "height": height}]}, count=4)
        assert told[0, 0] == want


def test_robots_are_white_before_a_dark_wall() -> None:
    dark = {**wall((2.0, -1.0), (2.0, 1.0)), "reflectance": 0.1}
    given = scenario(2, world={"walls": [dark]}, beams={**LIT, "count": 4})
    told = MujocoPlant(given).observe().reflectances
    assert told is not None
    assert told[0, 0] == WHITE and told[1, 0] == 0.1


def test_the_place_stays_that_of_the_sample_while_the_robot_turns_and_drives() -> None:
    """A scan held between samples, taken beam by beam: whoever sees the dark wall is told so, and nobody else."""
    beams = {**LIT, "count": 24, "rate_hz": 5.0, "scan_time": 0.2}
    walls = [{**wall((0.9, -3), (0.9, 3)), "reflectance": 0.2}]
    plant = MujocoPlant(scenario(walls=tuple(walls), beams=beams))
    for _ in range(50):
        plant.advance(np.array([[2.0, 3.0]]))
    seen = plant.observe()
    assert seen.reflectances is not None
    hit = (seen.ranges >= 0) & (seen.ranges < 4)  # farther off is the floor, which beams of a driving robot meet
    assert 0 < hit.sum() < 24
    np.testing.assert_array_equal(seen.reflectances, np.where(hit, 0.2, WHITE))


def test_white_worlds_and_sensors_without_a_signal_are_asked_nothing_more() -> None:
    """So that the model in their logs stays what it was."""
    around = {kind: [{**one, "reflectance": WHITE} for one in things] for kind, things in AROUND.items()}
    white = MujocoPlant(scenario(world=around, beams=LIT))
    seen = white.observe()
    assert seen.cosines is not None and seen.reflectances is None
    unlit = {**LIT, "signal_range": None}
    dark, bright = (MujocoPlant(scenario(world=one, beams=unlit)) for one in (AROUND, around))
    assert dark.model_xml == bright.model_xml
    assert dark.observe().cosines is None and dark.observe().reflectances is None


def test_a_dark_wall_is_lost_where_a_white_one_is_seen() -> None:
    """A step at power 1: of the white wall at 1 m all within 75 deg, of the dark one all within acos(0.88 / (0.2 * 9)).

    With a range of 3 m and no spread a beam at the angle a to the normal comes back from 1 / cos(a), so that the power
    is reflectance / 0.88 * 9 cos(a)^3.
    """
    beams = {**LIT, "count": 72, "signal_spread": 0.0, "range_max": 8.0}
    angle = np.deg2rad(np.minimum(5.0 * np.arange(72), 360 - 5.0 * np.arange(72)))
    for reflectance in (WHITE, 0.2, 0.09):
        walls = ({**wall((1.05, -40), (1.05, 40)), "reflectance": reflectance},)
        given = scenario(walls=walls, beams=beams, team={"start": [(0.04, 0)]})
        seen = sense(MujocoPlant(given).observe(), None, noise_parameters(given)).ranges[0]
        want = (angle < np.pi / 2) & (reflectance / 0.88 * 9 * np.clip(np.cos(angle), 0, 1) ** 3 >= 1)
        np.testing.assert_array_equal(np.isfinite(seen), want)


def test_cones_hear_the_surface_of_their_nearest_ray() -> None:
    """Half of the view is a dark wall, nearer; the other half a white one: the echo is the dark wall's."""
    walls = ({**wall((0.9, 0), (0.9, 3)), "reflectance": 0.0}, wall((1.5, -3), (1.5, 3)))
    for dark, want in ((0.0, False), (0.9, True)):
        given = scenario(
            walls=({**walls[0], "reflectance": dark}, walls[1]),
            beams={**LIT, "count": 4, "cone_deg": 20.0, "cone_rays": 8, "signal_spread": 0.0},
        )
        seen = sense(MujocoPlant(given).observe(), None, noise_parameters(given)).ranges[0, 0]
        assert np.isfinite(seen) == want


def test_a_batch_tells_what_one_plant_tells() -> None:
    given = scenario(2, world=AROUND, beams={**LIT, "count": 24}, team={"start": [(0, 0), (0.5, 0.3)]})
    alone, many = MujocoPlant(given), PlantBatch(given, 2, 1)
    want = alone.observe()
    for seen in many.observe():
        assert want.reflectances is not None and seen.reflectances is not None
        np.testing.assert_array_equal(seen.reflectances, want.reflectances)
        np.testing.assert_array_equal(seen.cosines, want.cosines)


@pytest.mark.parametrize("wrong", ["1.2", "-0.1"])
def test_more_light_than_came_is_refused(wrong: str) -> None:
    text = three(world=f"{{columns: [{{center: [0, 5], radius: 0.1, reflectance: {wrong}}}]}}")
    with pytest.raises(InputError, match=r"world\.columns\.0\.reflectance: is .*; allowed: a number from 0 to 1"):
        parse_scenario(text, "x.yaml")
