"""Polygons in convex parts, and worlds with prisms that have notches."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.obstacles import footprints, names
from pbrg_mj.scenario.checks.distances import distances_to_prism
from pbrg_mj.scenario.checks.world import extents
from pbrg_mj.scenario.polygons import convex_parts, is_simple
from pbrg_mj.scenario.schema import Prism
from pbrg_mj.scenario.schema.base import MOST_OBSTACLES
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.footprints import footprints_of, signed_distance
from pbrg_mj.world.sensors.surfaces import ReflectiveSurfaces
from tests.test_world_columns import brute
from tests.worlds import scenario

L = ((0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.0, 2.0))
U = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.6, 1.0), (1.6, 0.3), (0.4, 0.3), (0.4, 1.0), (0.0, 1.0))


def star(seed: int) -> tuple:
    """A polygon around a point, with notches of any depth: simple, since its corners go round."""
    random = np.random.default_rng(seed)
    sides = int(random.integers(4, 20))
    turns = 2 * np.pi * (np.arange(sides) + random.uniform(0.05, 0.95, sides)) / sides
    reach = random.uniform(0.2, 1.0, sides)
    corners = random.uniform(-2, 2, 2) + reach[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    return tuple(map(tuple, (corners if seed % 2 else corners[::-1]).tolist()))


def area(corners) -> float:
    x, y = np.array(corners).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def turns(corners) -> np.ndarray:
    side = np.roll(corners, -1, axis=0) - np.array(corners)
    after = np.roll(side, -1, axis=0)
    return side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0]


@pytest.mark.parametrize("corners", [L, U, L[::-1], *(star(seed) for seed in range(30))])
def test_parts_are_convex_and_cover_the_polygon_once(corners):
    parts = convex_parts(corners)
    if len(parts) > 1:
        assert all((turns(part) > 0).all() for part in parts)
    assert sum(abs(area(part)) for part in parts) == pytest.approx(abs(area(corners)), rel=1e-12)
    sides = Counter((part[k - 1], part[k]) for part in parts for k in range(len(part)))
    outline = {(corners[k - 1], corners[k]) for k in range(len(corners))}
    inner = [side for side in sides if side not in outline and side[::-1] not in outline]
    assert max(sides.values()) == 1 and all(side[::-1] in sides for side in inner)  # diagonals have a part on each side
    notches = int((turns(corners) * np.sign(area(corners)) < 0).sum())
    assert len(parts) <= 2 * notches + 1  # Hertel and Mehlhorn


def test_slivers_between_corners_on_one_line_are_left_out():
    """An E whose notches end on one line but for the fourth digit: one triangle between them is flat."""
    corners = [(0.217, 2.0999), (0.9313, 1.4507), (1.1045, 1.6413), (0.6283, 2.0741), (0.8015, 2.2647)]
    corners += [(1.0396, 2.0483), (1.2128, 2.2389), (0.9747, 2.4553), (1.1479, 2.6459), (1.6242, 2.2131)]
    corners += [(1.7974, 2.4038), (1.083, 3.0529)]
    prism = Prism(corners=tuple(corners))
    assert len(prism.convex()) == len(convex_parts(prism.corners)) - 1
    assert sum(abs(area(part.corners)) for part in prism.convex()) == pytest.approx(abs(area(corners)), abs=1e-6)
    assert not list(extents(scenario(world={"prisms": [{"corners": corners}]})))
    needle = Prism(corners=((0.0, 0.0), (1.0, 1.5e-6), (2.0, 0.0), (1.0, 3e-6)))
    assert len(needle.convex()) == len(convex_parts(needle.corners))


def test_a_dark_prism_is_dark_all_round_also_where_a_part_of_it_hardly_turns():
    """The part below the notches of this E has two sides on one line but for rounding."""
    corners = [(0.3236, 0.7231), (0.5589, 0.5239), (0.6648, 0.649), (0.5864, 0.7154)]
    corners += [(0.7982, 0.9656), (0.7197, 1.032), (0.508, 0.7818), (0.4295, 0.8482)]
    world = scenario(world={"prisms": [{"corners": corners, "reflectance": 0.1}]}).world
    assert not all(is_simple(part.corners) for part in world.prisms[0].convex())
    sides = np.array(corners) + 0.3 * (np.roll(corners, -1, axis=0) - np.array(corners))
    places = np.column_stack([sides, np.full(len(sides), 0.05)])
    np.testing.assert_array_equal(ReflectiveSurfaces(world).reflectances(places), 0.1)


def test_an_l_has_two_parts_and_a_u_three():
    assert [len(convex_parts(one)) for one in (L, U)] == [2, 3]


def test_parts_are_kept_for_one_world_and_not_for_all_that_a_study_draws():
    """Each is made once for as many prisms as a world has at most; drawn worlds do not fill the memory."""
    convex_parts.cache_clear()
    world = [tuple((x + k, y) for x, y in L) for k in range(MOST_OBSTACLES)]
    for corners in (*world, *world):
        convex_parts(corners)
    assert convex_parts.cache_info()[:2] == (MOST_OBSTACLES, MOST_OBSTACLES)
    for k in range(10):
        convex_parts(tuple((x, y + k + 1) for x, y in L))
    assert convex_parts.cache_info().currsize == MOST_OBSTACLES


@pytest.mark.parametrize("seed", range(12))
def test_distances_are_those_of_the_outline(seed):
    corners, random = star(seed), np.random.default_rng(seed)
    points = random.uniform(-3, 3, (60, 2))
    exact, prism = brute(points, np.array(corners)), Prism(corners=corners)
    found = signed_distance(points, footprints_of(prisms=[prism])).min(axis=1)
    outside = exact > 0
    np.testing.assert_allclose(found[outside], exact[outside], atol=2e-3)
    assert (found[~outside] <= 2e-3).all()
    np.testing.assert_allclose(distances_to_prism(prism, points), np.maximum(exact, 0.0), atol=2e-3)


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (1, 1), (1, 0), (0, 1)),
        ((0, 0), (1, 0), (2, 0), (1, 1)),
        ((0, 0), (0, 0), (1, 1)),
        ((0, 0), (2, 0), (2, 2), (1, 0), (0, 2)),  # a corner on a side
        ((0, 0), (2, 0), (1, 1), (2, 2), (0, 2), (1, 1)),  # two corners in one place
    ],
)
def test_polygons_whose_sides_meet_are_no_polygons(corners):
    assert not is_simple(corners)
    with pytest.raises(ValueError, match="meet"):
        convex_parts(corners)


def test_beams_see_into_a_notch_and_margins_count_it():
    corners = [
        (x + 1.0, y - 1.0) for x, y in ((0, 0), (1, 0), (1, 2), (0, 2), (0, 1.4), (0.6, 1.4), (0.6, 0.6), (0, 0.6))
    ]
    beams = {"count": 72, "range_min": 0.0}
    one = scenario(1, beams=beams, world={"prisms": [{"corners": corners}]})
    plant = MujocoPlant(one)
    assert plant.observe().ranges[0, 0] == pytest.approx(1.6 + plant.robot.hand_offset, abs=1e-3)
    assert plant.truth().wall_margin[0] == pytest.approx(np.hypot(1.0, 0.4) - plant.robot.clearance, abs=1e-6)
    assert names(one) == ["prisms.0"] * 3 and len(footprints(one).first) == 4
