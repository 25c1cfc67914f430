"""Places in buildings: a planted building stands where it must, seen from a place on its way."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_families
from pbrg_mj.scenario.families.buildings import place_ahead, way_from
from pbrg_mj.scenario.load import load_text

FAMILY = """\
description: "two rooms"
team: {leaders: [1]}
draw:
  team: {robots: 3, start_radius: 0.4, formation_radius: 0.4}
  reference: {distance: 2.0, direction_deg: 0.0}
  buildings:
    - walls: [[[0, -3], [10, -3], [10, 1.0], [0, 1.0]], [[30, 30], [31, 30]]]
      posts: [[5, -2.5], [40, 40]]
      way: [[1, -1], [9, -1]]
      within: 20
    - {walls: [[[0, 7], [9, 7]]], way: [[0, 5], [4, 5], [4, 0]], thickness: 0.1}
"""
GOLDEN_START = ((-0.2322, 0.2057), (0.3227, -0.0157), (-0.035, -0.1462))
GOLDEN_WALLS = [((-6.6862, -2.0), (3.3138, -2.0)), ((3.3138, -2.0), (3.3138, 2.0)), ((3.3138, 2.0), (-6.6862, 2.0))]


def world(seed: int, text: str = FAMILY, *overrides: str):
    return load_text(text, "rooms", [f"seed={seed}", *overrides], file="rooms.yaml").scenario


@cache
def seeds_of(walls: int) -> list[int]:
    """Seeds whose building has so many walls in sight: about half of them."""
    found = [seed for seed in range(1, 40) if len(world(seed).world.walls) == walls]
    assert 10 < len(found) < 29
    return found


def test_a_seed_draws_one_of_the_buildings_and_a_place_on_its_way():
    first, second = seeds_of(3), seeds_of(1)
    assert len(first) + len(second) == 39
    places = []
    for seed in first:
        drawn = world(seed)
        bottom, right, top = drawn.world.walls
        (post,) = drawn.world.columns
        x = -bottom.start[0]  # of the place in the building, whose way runs along x at y = -1
        assert 1 <= x <= 7 and drawn.operator.reference == (2.0, 0.0)
        ends = [one for wall in (bottom, right, top) for one in (wall.start, wall.end)]
        wanted = [(-x, -2), (10 - x, -2), (10 - x, -2), (10 - x, 2), (10 - x, 2), (-x, 2)]
        np.testing.assert_allclose(ends, wanted, atol=2e-4)
        np.testing.assert_allclose(post.center, (5 - x, -1.5), atol=2e-4)
        assert (bottom.thickness, post.radius) == (0.04, 0.02)
        places.append(x)
    assert len(set(places)) == len(places) and max(places) - min(places) > 3  # uniform over 6 m


def test_the_reference_is_where_the_way_is_first_so_far_off_and_ahead_of_the_team():
    seen = set()
    for seed in seeds_of(1):
        (wall,) = world(seed).world.walls
        a, b = np.array(wall.start), np.array(wall.end)
        u = (b - a) / 9.0  # the building's x axis in the world; y is to its left
        place = -a @ np.array([u, (-u[1], u[0])]).T + (0, 7)  # of the world's origin, in the building
        ahead = place + 2.0 * np.array([u[0], -u[1]])  # the world's x axis leads to the reference
        assert wall.thickness == 0.1 and math.dist(a, b) == pytest.approx(9.0, abs=2e-4)
        before = place[0] < 4 - 1e-3
        on_first, on_second = abs(place[1] - 5) < 1e-3, abs(place[0] - 4) < 1e-3
        assert (on_first and place[0] >= 0) or (on_second and place[1] >= 2 - 1e-3)
        wanted = (place[0] + 2, 5) if place[0] <= 2 else (4, 5 - math.sqrt(4 - (4 - place[0]) ** 2))
        if not before:
            wanted = (4, place[1] - 2)
        np.testing.assert_allclose(ahead, wanted, atol=2e-3)
        seen.add((before, bool(place[0] <= 2)))
    assert {(True, True), (True, False), (False, False)} <= seen


@pytest.mark.parametrize("turn", [30.0, -100.0])
def test_a_building_is_turned_with_the_way(turn):
    seed = seeds_of(3)[0]
    plain, turned = world(seed), world(seed, FAMILY, f"draw.reference.direction_deg={turn}")
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    for before, after in zip(plain.world.walls, turned.world.walls, strict=True):
        for (x, y), moved in ((before.start, after.start), (before.end, after.end)):
            np.testing.assert_allclose(moved, (c * x - s * y, s * x + c * y), atol=2e-4)
    np.testing.assert_allclose(turned.operator.reference, (2 * c, 2 * s), atol=1e-4)


def test_what_is_farther_than_within_is_left_out():
    for seed in seeds_of(3)[:5]:
        x = -world(seed).world.walls[0].start[0]
        near = world(seed, FAMILY, "draw.buildings.0.within=2.1").world
        assert len(near.walls) == (3 if 10 - x <= 2.1 else 2)
        assert len(near.columns) == (math.hypot(5 - x, 1.5) <= 2.1)


def test_starts_keep_their_clearance_by_places_that_are_drawn_again():
    """Walls 0.4 m from the way on its first 4 m leave no room there for points 0.3 m off them in a disc of 0.4 m."""
    narrow = FAMILY.replace("[[30, 30], [31, 30]]", "[[0, -1.4], [4, -1.4]], [[0, -0.6], [4, -0.6]]")
    for seed in seeds_of(3)[:8]:
        drawn = world(seed, narrow)
        wall = drawn.world.walls[3]
        start = np.array(drawn.team.start)
        off = np.hypot(
            np.clip(np.abs(start[:, 0] - (wall.start[0] + wall.end[0]) / 2) - 2, 0, None),
            np.clip(np.abs(start[:, 1] - wall.start[1]) - 0.02, 0, None),
        )
        assert off.min() >= 0.3 - 1e-9
        assert -drawn.world.walls[0].start[0] > 3.5  # in the building: beyond the narrow half, but for its end


def test_draws_of_a_seed_stay_as_they_are():
    """Written down once."""
    assert world(1).team.start == GOLDEN_START
    assert [(wall.start, wall.end) for wall in world(1).world.walls] == GOLDEN_WALLS


def test_other_entries_stand_in_the_building_and_draw_as_without_it():
    box = "  boxes: [{along: {uniform: [1.0, 1.5]}, across: {uniform: [-1, 1]}, length: 0.2, width: 0.2}]\n"
    both = world(3, FAMILY + box)
    alone = world(3, FAMILY[: FAMILY.index("  buildings")] + box)
    assert both.world.boxes == alone.world.boxes and both.team == alone.team
    assert both.world.walls == world(3).world.walls


def test_ways_are_walked_by_their_length():
    way = ((0.0, 0.0), (3.0, 0.0), (3.0, 4.0))
    assert way_from(way, 1.0) == ((1.0, 0.0), way[1:])
    assert way_from(way, 5.0) == ((3.0, 2.0), way[2:])
    assert way_from(way, 7.0) == ((3.0, 4.0), ())
    assert place_ahead((0.0, 0.0), way[1:], 5.0) == pytest.approx((3.0, 4.0))
    assert place_ahead((0.0, 0.0), way[1:], 5.001) is None
    assert place_ahead((0.0, 0.0), ((1.0, 0.0), (1.0, 0.0), (-3.0, 0.0)), 2.0) == pytest.approx((-2.0, 0.0))


MISTAKES = {
    "one corner": ("[[[0, 7], [9, 7]]]", "[[[0, 7]]]", "rooms.yaml:11: draw.buildings.1.walls.0: "),
    "no way": ("[[0, 5], [4, 5], [4, 0]]", "[[0, 5]]", "rooms.yaml:11: draw.buildings.1.way: "),
    "short way": ("distance: 2.0", "distance: 20.0", "finds no place in 1000 draws that keeps 0.3 m from"),
    "backwards": ("distance: 2.0", "distance: -1.0", "has the reference -1 m ahead; allowed: more than 0"),
    "unknown": ("within: 20", "withn: 20", "rooms.yaml:10: draw.buildings.0.withn: is unknown; did you mean `within`?"),
    "no thickness": ("thickness: 0.1", "thickness: 0", "rooms.yaml:11: draw.buildings.1.thickness: is 0; allowed: a"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_one_line_with_the_key(name):
    before, after, said = MISTAKES[name]
    assert before in FAMILY
    with pytest.raises(InputError) as caught:
        world(1, FAMILY.replace(before, after))
    assert said in str(caught.value) and "draw.buildings." in str(caught.value)


def test_a_place_without_room_and_too_many_walls_are_told_with_the_entry():
    with pytest.raises(InputError, match=r"draw\.buildings\.[01]: finds no place in 1000 draws .* 2 m ahead"):
        world(1, FAMILY, "draw.start_clearance=90")
    teeth = ", ".join(f"[{k % 2}, {k / 500:g}]" for k in range(510))
    many = FAMILY.replace("[[0, 7], [9, 7]]", f"[{teeth}]").replace("[[30, 30], [31, 30]]", f"[{teeth}]")
    with pytest.raises(InputError, match=r"has 5\d\d walls within .* m of a place on its way; allowed: at most 500"):
        world(1, many)


def test_the_bundled_buildings_are_small_and_each_is_drawn():
    file = bundled_families()["families/real_building"]
    assert file.stat().st_size < 100_000
    drawn = [pbrg.draw("families/real_building", seed).settings.world for seed in range(301, 304)]
    assert all(40 <= len(one.walls) <= 400 for one in drawn)
