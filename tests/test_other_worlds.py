"""The generator of other worlds: what it draws is free where it says so, by the program's own geometry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.world.scene.footprints import signed_distance, world_footprints
from pbrg_mj.world.scene.obstacles import moving_footprints

SCRIPTS = Path(__file__).parents[1] / "scripts"


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)


def test_distances_from_a_polygon_are_those_of_a_rectangle_in_its_axes() -> None:
    from other_worlds.geometry import outline, rectangle
    from other_worlds.geometry import signed_distance as from_polygon

    rng = np.random.default_rng(1)
    for _ in range(20):
        center, size, angle = rng.normal(size=2), rng.uniform(0.1, 2.0, 2), rng.uniform(-np.pi, np.pi)
        axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        points = center + rng.normal(size=(200, 2))
        beyond = np.abs((points - center) @ axes.T) - size / 2
        expected = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
        for corners in (rectangle(center, size, angle), rectangle(center, size, angle)[::-1]):
            np.testing.assert_allclose(from_polygon(points, corners), expected, atol=1e-12)
            edge = outline(corners)
            np.testing.assert_allclose(from_polygon(edge, corners), 0.0, atol=1e-12)
            assert np.linalg.norm(np.diff(edge, axis=0), axis=1).max() <= 0.03 + 1e-12


@pytest.mark.parametrize("kind", ["static", "moving", "robots", "indoor", "conditions"])
def test_a_world_is_that_of_its_seed_and_its_start_is_free(kind: str) -> None:
    from other_worlds.draw import GENERIC, INDOORS, ROBOTS, scenario

    descriptions = set()
    for seed in range(1, 16):
        drawn = scenario(kind, seed)
        assert drawn == scenario(kind, seed) and drawn != scenario(kind, seed + 1)
        settings = pbrg.load(drawn, {"set_up": "recommended"}).settings
        descriptions.add(drawn["description"])
        scale, clearance = ROBOTS.get(drawn["robot"], GENERIC)
        start, standing = np.array(settings.team.start), world_footprints(settings.world)
        distances = signed_distance(start, standing)
        beyond = scale * (0.01 if kind in INDOORS else 0.06)
        assert distances.min(initial=np.inf) > clearance + beyond - 1e-3
        apart = np.linalg.norm(start[:, None] - start, axis=-1)[np.triu_indices(len(start), 1)]
        assert apart.min() > 2 * clearance
        assert bool(settings.world.moving_boxes) == (kind == "moving")
        assert settings.robot == "generic" or kind in ("robots", *INDOORS)
        assert settings.robot != "generic" or kind != "robots"
    assert len(descriptions) > 5


def test_every_cell_of_a_maze_is_joined_to_every_other() -> None:
    from other_worlds.indoor import _spanning_tree

    for size in (3, 4, 5):
        pairs = _spanning_tree(np.random.default_rng(size), size)
        assert len(pairs) == size**2 - 1
        reached = {(0, 0)}
        while more := {one for pair in pairs if pair & reached for one in pair} - reached:
            reached |= more
        assert len(reached) == size**2
        assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in map(tuple, pairs))


def test_moving_boxes_touch_nothing_and_are_slower_than_half_a_robots_speed() -> None:
    from other_worlds.draw import scenario

    boxes_met = 0
    for seed in range(101, 121):
        world = pbrg.load(scenario("moving", seed)).settings.world
        standing = world_footprints(world)
        for box in world.moving_boxes:
            places = zip(box.waypoints, box.waypoints[1:], strict=False)
            speeds = [np.linalg.norm(np.subtract(b.center, a.center)) / (b.time - a.time) for a, b in places]
            assert max(speeds) < 0.3
        for time in np.arange(0.0, 8.0, 0.5):
            prints = moving_footprints(world.moving_boxes, time)
            half = prints.half_size[:, None] * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
            for k, corners in enumerate(prints.centre[:, None] + half):
                others = np.arange(len(half)) != k
                assert signed_distance(corners, standing).min(initial=np.inf) > 0.0
                assert signed_distance(corners, prints)[:, others].min(initial=np.inf) > 0.0
                boxes_met += others.sum()
    assert boxes_met > 100


@pytest.mark.parametrize(("unknown", "touches"), [({}, False), ({"estimator.unknown": "free"}, True)])
def test_an_omnidirectional_robot_drives_into_what_its_beams_leave_out_only_where_that_is_free(
    unknown: dict[str, str], touches: bool
) -> None:
    """Beams in a sector ahead: under `free` one is against something that it has never seen within 0.3 s."""
    from other_worlds.draw import scenario

    drawn = scenario("conditions", 126)
    assert drawn["robot"] == "omni" and drawn["sensors"]["beams"]["sweep_deg"] < 360.0
    run = pbrg.run(pbrg.load(drawn, {"set_up": "recommended", **unknown}, duration=1.0))
    assert bool(run.metrics.wall_contacts) == touches
