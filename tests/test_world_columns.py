"""Columns and prisms: margins, beams, contacts, checks and pictures."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.obstacles import faces, footprints, names, outlines
from pbrg_mj.errors import InputError
from pbrg_mj.log.scene.static import static_scene
from pbrg_mj.scenario.checks.distances import distances_to_column, distances_to_prism
from pbrg_mj.scenario.schema import Column, Prism
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.footprints import counter_clockwise, footprints_of, least_along, signed_distance, wall_margin
from tests.worlds import scenario, wall

HEXAGON = [(2 + 0.5 * np.cos(a), 1 + 0.5 * np.sin(a)) for a in np.deg2rad([10, 60, 110, 170, 240, 310])]


def convex(random, sides):
    turns = np.sort(random.uniform(0, 2 * np.pi, sides))
    while np.diff([*turns, turns[0] + 2 * np.pi]).max() > 3 or np.diff(turns).min() < 0.05:
        turns = np.sort(random.uniform(0, 2 * np.pi, sides))
    return random.uniform(-2, 2, 2) + random.uniform(0.1, 1) * np.column_stack([np.cos(turns), np.sin(turns)])


def brute(points, corners):
    """Signed distances from dense points of the outline; inside by the ray to the right."""
    ends = np.roll(corners, -1, axis=0)
    dense = np.concatenate([a + np.linspace(0, 1, 4000)[:, None] * (b - a) for a, b in zip(corners, ends, strict=True)])
    least = np.array([np.hypot(*(dense - point).T).min() for point in points])
    crossed = np.zeros(len(points), dtype=int)
    for (ax, ay), (bx, by) in zip(corners, ends, strict=True):
        between = (ay > points[:, 1]) != (by > points[:, 1])
        at = ax + (points[:, 1] - ay) / (by - ay) * (bx - ax)
        crossed += between & (points[:, 0] < at)
    return np.where(crossed % 2, -least, least)


@pytest.mark.parametrize("seed", range(8))
def test_distances_from_prisms_are_those_of_their_outlines(seed):
    random = np.random.default_rng(seed)
    corners, points = convex(random, int(random.integers(3, 9))), random.uniform(-3, 3, (60, 2))
    points = np.concatenate([points, corners.mean(axis=0) + random.uniform(-0.1, 0.1, (20, 2))])
    exact = brute(points, corners)
    for given in (corners, corners[::-1]):
        prism = Prism(corners=tuple(map(tuple, given.tolist())))
        around = footprints_of(prisms=[prism])
        np.testing.assert_allclose(signed_distance(points, around)[:, 0], exact, atol=2e-3)
        np.testing.assert_allclose(
            wall_margin(points, around, 0.1), signed_distance(points, around)[:, 0] - 0.1, atol=1e-12
        )
        np.testing.assert_allclose(distances_to_prism(prism, points), np.maximum(exact, 0.0), atol=2e-3)


def test_the_margin_is_to_the_nearest_of_all_kinds():
    random = np.random.default_rng(3)
    column, prism = Column(center=(1.0, 1.0), radius=0.4), Prism(corners=tuple(HEXAGON))
    one = scenario(walls=[wall((-2, -1), (2, -1))]).world.walls
    around, points = footprints_of(one, [column], [prism]), random.uniform(-3, 3, (200, 2))
    parts = [footprints_of(one), footprints_of(columns=[column]), footprints_of(prisms=[prism])]
    least = np.min([wall_margin(points, part, 0.1) for part in parts], axis=0)
    np.testing.assert_array_equal(wall_margin(points, around, 0.1), least)
    np.testing.assert_allclose(signed_distance(points, around)[:, 1], np.hypot(*(points - (1, 1)).T) - 0.4, atol=1e-15)
    np.testing.assert_allclose(
        distances_to_column(column, points), np.maximum(signed_distance(points, around)[:, 1], 0)
    )
    for angle in np.linspace(0, 6, 7):
        G = np.array([np.cos(angle), np.sin(angle)])
        drawn = [(outline @ G).min() for outline in outlines(around)]
        np.testing.assert_allclose(least_along(G, around), drawn, atol=1.2e-3)


def with_solids(**sections):
    solids = {"columns": [{"center": (1.0, 0.0), "radius": 0.3}], "prisms": [{"corners": HEXAGON}]}
    return scenario(beams={"robots": "all", "count": 360, "range_min": 0.0}, world=solids, **sections)


def test_beams_meet_them_where_they_are():
    plan = with_solids()
    plant = MujocoPlant(plan)
    centre, angles = plant.truth().body_pose[0, :2], np.deg2rad(np.arange(360))
    ranges = plant.observe().ranges[0]
    hit = ranges > 0
    ends = centre + ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    assert hit.sum() > 50
    np.testing.assert_allclose(signed_distance(ends[hit], footprints(plan)).min(axis=1), 0.0, atol=1e-6)
    assert ranges[0] == pytest.approx(1.0 - 0.3 - centre[0], abs=1e-9)


def test_the_written_model_is_the_same_simulation():
    plant = MujocoPlant(with_solids())
    again = mujoco.MjModel.from_xml_string(plant.model_xml)
    for name in ("geom_pos", "geom_quat", "geom_size", "mesh_vert"):
        assert getattr(again, name).tobytes() == getattr(plant.model, name).tobytes()


@pytest.mark.parametrize(
    "solid",
    [
        {"columns": [{"center": (0.4, 0.0), "radius": 0.2}]},
        {"prisms": [{"corners": [(0.2, 0), (0.6, -0.3), (0.6, 0.3)]}]},
    ],
)
def test_whoever_drives_into_one_touches_it(solid):
    plant = MujocoPlant(scenario(world=solid))
    contacts, least = [], np.inf
    for _ in range(200):
        plant.advance(np.full((1, 2), 3.0))
        truth = plant.truth()
        contacts.append((truth.wall_contact[0], truth.moving_contact[0], truth.robot_contact[0]))
        least = min(least, truth.wall_margin[0])
    walls, moving, robots = map(any, zip(*contacts, strict=True))
    assert walls and not moving and not robots
    # The body's disc is 0.06 m about a centre 0.04 m behind the hand point, which stands before the face.
    assert -0.1 <= least < -0.07


def test_seeds_side_by_side_know_them():
    plan = {
        "timing": {"duration": 0.1},
        "team": {"start": [[0, 0]], "formation": [[0, 0]], "leaders": [1]},
        "operator": {"reference": [1, 1]},
        "world": {"columns": [{"center": [0.5, 0], "radius": 0.2}], "prisms": [{"corners": [[0, 1], [1, 1], [0, 2]]}]},
    }
    many, alone = pbrg.batch(pbrg.load(plan), [1]), pbrg.run(pbrg.load(plan))
    np.testing.assert_array_equal(many.wall_margin_m[0], alone.wall_margin_m)
    assert alone.wall_margin_m[0, 0] == pytest.approx(0.5 - 0.2 - 0.1, abs=1e-9)


def test_faces_outlines_and_names():
    plan = with_solids(walls=[wall((0, 3), (1, 3))])
    around = footprints(plan)
    assert names(plan) == ["walls.0", "columns.0", "prisms.0"]
    assert len(faces(around, 1)[0]) == 0
    G, h = faces(around, 2)
    polygon = counter_clockwise(np.array(HEXAGON))
    assert (h[:, None] - 1e-12 <= G @ polygon.T).all() and (
        (h[:, None] + 1e-12 >= G @ polygon.T).sum(axis=1) == 2
    ).all()
    x, y = outlines(around)[1].T
    assert abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2) == pytest.approx(np.pi * 0.3**2, rel=0.01)
    assert b"columns and prisms" in static_scene(plan)
    assert b"columns and prisms" not in static_scene(scenario())


BASE = {"team": {"start": [[0, 0]], "formation": [[0, 0]], "leaders": [1]}, "operator": {"reference": [1, 1]}}
WRONG = {
    "in a robot": (
        {"columns": [{"center": [0.1, 0], "radius": 0.2}]},
        "columns.0: stands in robot 1 at its start",
    ),
    "prism in one": (
        {"prisms": [{"corners": [[-1, -1], [1, -1], [0, 1]]}]},
        "prisms.0: stands in robot 1",
    ),
    "no radius": (
        {"columns": [{"center": [1, 0], "radius": 0}]},
        "columns.0.radius: is 0; allowed: a number",
    ),
    "two corners": ({"prisms": [{"corners": [[1, 0], [2, 0]]}]}, "prisms.0.corners"),
    "crossed": ({"prisms": [{"corners": [[1, 0], [2, 1], [2, 0], [1, 1]]}]}, "allowed: corners of a polygon"),
    "straight": ({"prisms": [{"corners": [[1, 0], [2, 0], [3, 0], [2, 1]]}]}, "allowed: corners of a polygon"),
    "star": (
        {"prisms": [{"corners": [[3 + np.cos(a), np.sin(a)] for a in 4 * np.pi / 5 * np.arange(5)]}]},
        "allowed: corners of a polygon",
    ),
    "tall": (
        {"prisms": [{"corners": [[1, 0], [2, 0], [2, 1]], "height": 1e7}]},
        "prisms.0: is flat or thin; allowed: a least",
    ),
    "flat": ({"prisms": [{"corners": [[1, 0], [2, 0], [2, 1]], "height": 1e-7}]}, "prisms.0: is flat or thin"),
    "a ramp": (
        {"ramps": [{"from": [1, 0], "to": [2, 0], "width": 1e-9, "height": 1e-9}]},
        "ramps.0: is flat or thin; allowed: a least extent of at least a millionth of the greatest",
    ),
    "same corner": ({"prisms": [{"corners": [[1, 0], [1, 0], [2, 1]]}]}, "allowed: corners of a polygon"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named(name):
    world, said = WRONG[name]
    with pytest.raises(InputError) as caught:
        pbrg.load(BASE | {"world": world})
    assert said in str(caught.value)
